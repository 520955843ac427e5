/* A scan as of a laser scanner, from what an exported detector says of some columns.
 *
 * The fields are those of sensor_msgs/LaserScan of ROS, which is not needed here: copy them into its message. Angles are
 * in radians, positive to the left; distances in metres along the floor, from the point below the lens.
 *
 * A scan has evenly spaced angles that stay the same from frame to frame. The bearing of a column is neither: a camera
 * that looks down sees what is near under a wider angle. So the angles go over all bearings that the columns can have, as
 * close as the columns are far away, and each angle takes what the columns around it say. The rules are those of vsonar's
 * own `camera::scan`. */
#ifndef LASER_SCAN_H
#define LASER_SCAN_H

#include "detector.h"

#if !DETECTOR_HAS_RANGES
#error "a scan needs distances: export the detector with --camera"
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define LASER_SCAN_COLUMNS 12       /* of the image; at least 2 */
#define LASER_SCAN_MOST_ANGLES 4097 /* far more than a real camera leads to */

typedef struct LaserScan {
    struct {
        struct {
            int32_t sec;
            uint32_t nanosec;
        } stamp;              /* when the frame was taken */
        const char *frame_id; /* of the point on the floor below the lens, x straight ahead */
    } header;
    float angle_min;       /* the first angle, rightmost */
    float angle_max;       /* the last one */
    float angle_increment; /* from one to the next */
    float time_increment;  /* 0: all ranges are of one instant */
    float scan_time;       /* seconds from one scan to the next */
    float range_min;       /* 0 */
    float range_max;       /* what is farther is not given */
    /* From right to left, after REP 117: infinite where nothing is in view up to range_max, NaN where nothing is known.
     * A camera measures no intensities. */
    float ranges[LASER_SCAN_MOST_ANGLES];
    int angles; /* so many of the ranges are used */
} LaserScan;

/* Sets all but the ranges and the stamp: the angles follow from the columns and the camera that the detector was
 * exported with. */
void laser_scan_init(LaserScan *scan, const int32_t columns[LASER_SCAN_COLUMNS], const char *frame_id, float range_max,
    float scan_time);

/* Sets the ranges: found is what detector_ranges gave for the same columns. */
void laser_scan_fill(LaserScan *scan, const detector_range found[LASER_SCAN_COLUMNS]);

#ifdef __cplusplus
}
#endif

#endif
