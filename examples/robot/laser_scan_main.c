/* Prints a laser scan of each frame from standard input, as `ros2 topic echo` would: YAML.
 *
 *   cc -O2 laser_scan_main.c laser_scan.c -Idetector detector/libdetector.a -lm -o laser_scan
 *   ffmpeg -i drive.mp4 -vf scale=320:240 -pix_fmt gray -f rawvideo - | ./laser_scan 30
 *
 * The argument is the number of frames in a second, 10 if none is given; stamps count from the first frame.
 */
#include <math.h>

#include "frames.h"
#include "laser_scan.h"

#ifndef RANGE_MAX
#define RANGE_MAX 5.0f /* metres: a camera on a small robot tells little beyond */
#endif

static uint8_t pixels[FRAME_PIXELS];

static void print_number(const char *name, float number)
{
    if (isfinite(number))
        printf("%s %.9g\n", name, number);
    else
        printf("%s %s\n", name, isnan(number) ? ".nan" : ".inf");
}

static void print_scan(const LaserScan *scan)
{
    printf("header:\n  stamp:\n    sec: %ld\n    nanosec: %lu\n  frame_id: %s\n", (long)scan->header.stamp.sec,
        (unsigned long)scan->header.stamp.nanosec, scan->header.frame_id);
    print_number("angle_min:", scan->angle_min);
    print_number("angle_max:", scan->angle_max);
    print_number("angle_increment:", scan->angle_increment);
    print_number("time_increment:", scan->time_increment);
    print_number("scan_time:", scan->scan_time);
    print_number("range_min:", scan->range_min);
    print_number("range_max:", scan->range_max);
    printf("ranges:\n");
    for (int i = 0; i < scan->angles; i++)
        print_number("-", scan->ranges[i]);
    printf("intensities: []\n---\n");
}

int main(int argc, char **argv)
{
    frames in = {0};
    long rate = 10;
    int32_t columns[LASER_SCAN_COLUMNS];
    detector_range found[LASER_SCAN_COLUMNS];
    /* What the median remembers, which may be nothing; C has no array of nothing. */
    float state[DETECTOR_STATE_FLOATS(LASER_SCAN_COLUMNS) + 1];
    static LaserScan scan;

    if (argc > 1) {
        char *end;
        rate = strtol(argv[1], &end, 10);
        if (argc > 2 || end == argv[1] || *end || rate < 1 || rate > 1000000) {
            fprintf(stderr, "usage: laser_scan [FRAMES A SECOND, 1 to 1000000] < FRAMES\n");
            return 2;
        }
    }
    for (int i = 0; i < LASER_SCAN_COLUMNS; i++)
        columns[i] = (2 * i + 1) * DETECTOR_WIDTH / (2 * LASER_SCAN_COLUMNS);
    laser_scan_init(&scan, columns, "camera_footprint", RANGE_MAX, 1.0f / (float)rate);
    detector_reset(state, LASER_SCAN_COLUMNS);

    while (frames_next(&in, pixels)) {
        int error = detector_ranges(pixels, DETECTOR_WIDTH, 1, columns, LASER_SCAN_COLUMNS, state, found);
        if (error) {
            fprintf(stderr, "error: the detector refuses: %d, see detector.h\n", error);
            return 1;
        }
        laser_scan_fill(&scan, found);
        scan.header.stamp.sec = (int32_t)((in.number - 1) / (unsigned long)rate);
        scan.header.stamp.nanosec = (uint32_t)((in.number - 1) % (unsigned long)rate * 1000000000ULL / (unsigned long)rate);
        print_scan(&scan);
        if (fflush(stdout)) {
            fprintf(stderr, "error: cannot write to standard output: %s\n", strerror(errno));
            return 1;
        }
    }
    if (in.number == 0) {
        fprintf(stderr, "error: there is no frame on standard input\n");
        return 1;
    }
    return 0;
}
