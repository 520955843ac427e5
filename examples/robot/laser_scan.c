/* See laser_scan.h. Link with -lm. */
#include "laser_scan.h"

#include <math.h>

/* Radians in a degree. */
static const double DEGREE = 3.14159265358979323846 / 180.0;

/* The direction in which a pixel's centre is seen, after the model of the camera that vsonar documents in `camera`. */
static float bearing(int32_t column, int32_t row)
{
    /* From the middle of the image, in halves of its width. */
    double x = (2.0 * column + 1.0 - DETECTOR_WIDTH) / DETECTOR_WIDTH;
    double y = (2.0 * row + 1.0 - DETECTOR_HEIGHT) / DETECTOR_WIDTH;
    double k = DETECTOR_CAMERA_DISTORTION;
    double slope = tan(DETECTOR_CAMERA_FIELD_OF_VIEW * DEGREE / 2.0) * (1.0 + k) / (1.0 + k * (x * x + y * y));
    double down = sin(DETECTOR_CAMERA_PITCH * DEGREE) + y * slope * cos(DETECTOR_CAMERA_PITCH * DEGREE);
    /* No obstacle stands above the horizon: its bearing is that of the top row. */
    if (row > 0 && down <= 0.0)
        return bearing(column, 0);
    double forward = cos(DETECTOR_CAMERA_PITCH * DEGREE) - y * slope * sin(DETECTOR_CAMERA_PITCH * DEGREE);
    return (float)atan2(-x * slope, forward);
}

void laser_scan_init(LaserScan *scan, const int32_t columns[LASER_SCAN_COLUMNS], const char *frame_id, float range_max,
    float scan_time)
{
    float least = INFINITY, greatest = -INFINITY, top_least = INFINITY, top_greatest = -INFINITY;
    for (int i = 0; i < LASER_SCAN_COLUMNS; i++) {
        const float top = bearing(columns[i], 0);
        top_least = fminf(top_least, top);
        top_greatest = fmaxf(top_greatest, top);
        /* With a pincushion lens the widest bearing is between the top and the bottom row. */
        for (int32_t row = 0; row < DETECTOR_HEIGHT; row++) {
            least = fminf(least, bearing(columns[i], row));
            greatest = fmaxf(greatest, bearing(columns[i], row));
        }
    }
    /* As close as the columns are on average in the top row. */
    const float apart = (top_greatest - top_least) / (LASER_SCAN_COLUMNS - 1);
    float steps = ceilf((greatest - least) / apart);
    steps = fminf(fmaxf(steps, LASER_SCAN_COLUMNS - 1), LASER_SCAN_MOST_ANGLES - 1);

    scan->header.stamp.sec = 0;
    scan->header.stamp.nanosec = 0;
    scan->header.frame_id = frame_id;
    scan->angle_min = least;
    scan->angle_max = greatest;
    scan->angle_increment = (greatest - least) / steps;
    scan->time_increment = 0.0f;
    scan->scan_time = scan_time;
    scan->range_min = 0.0f;
    scan->range_max = range_max;
    scan->angles = (int)steps + 1;
    for (int i = 0; i < scan->angles; i++)
        scan->ranges[i] = NAN;
}

void laser_scan_fill(LaserScan *scan, const detector_range found[LASER_SCAN_COLUMNS])
{
    const int n = LASER_SCAN_COLUMNS;
    const detector_range *sorted[LASER_SCAN_COLUMNS];
    const float half = scan->angle_increment / 2.0f;

    /* By bearing, from right to left. */
    for (int i = 0; i < n; i++) {
        int at = i;
        for (; at > 0 && sorted[at - 1]->bearing > found[i].bearing; at--)
            sorted[at] = sorted[at - 1];
        sorted[at] = &found[i];
    }
    /* How far beyond the outermost bearings something is still known: half the gap to the next. */
    const float first = sorted[0]->bearing, last = sorted[n - 1]->bearing;
    const float right = fmaxf(half, (sorted[1]->bearing - first) / 2.0f);
    const float left = fmaxf(half, (last - sorted[n - 2]->bearing) / 2.0f);

    for (int i = 0; i < scan->angles; i++) {
        /* An angle takes the least distance of all columns within half an increment of it, and of the one next to it,
         * so that no obstacle is lost to a column beside it that sees none. `fminf` passes over a NaN. */
        const float angle = scan->angle_min + (float)i * scan->angle_increment;
        const detector_range *next = sorted[0];
        float least = NAN;
        for (int j = 0; j < n; j++) {
            const float off = fabsf(sorted[j]->bearing - angle);
            if (off <= half)
                least = fminf(least, sorted[j]->distance);
            if (off < fabsf(next->bearing - angle))
                next = sorted[j];
        }
        if (first - angle <= right && angle - last <= left)
            least = fminf(least, next->distance);
        scan->ranges[i] = least > scan->range_max ? INFINITY : least;
    }
}
