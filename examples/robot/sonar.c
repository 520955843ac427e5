/* Runs an exported detector on frames from standard input, and prints what it sees: a line of JSON for each frame.
 *
 *   vsonar export best.gp --name detector --out detector --camera camera.toml --median 3
 *   cc -O2 sonar.c -Idetector detector/libdetector.a -o sonar
 *   ffmpeg -i drive.mp4 -vf scale=320:240 -pix_fmt gray -f rawvideo - | ./sonar 12
 *
 * The frames are raw gray pixels or Y4M, of the detector's size. The argument is the number of columns, spread evenly
 * over the image. A line has an array for each thing known, a number for each column, as `vsonar run` prints them.
 * Numbers that are infinite or invalid are null, for JSON has neither; the status says which: "obstacle", "none-in-view" or
 * "invalid". An export without a camera gives rows only.
 */
#include <math.h>

#include "detector.h"
#include "frames.h"

#if DETECTOR_ABI != 1
#error "this program was written for version 1 of the interface"
#endif

/* A frame and what is known of its columns. The detector itself keeps nothing. */
static uint8_t pixels[FRAME_PIXELS];
static int32_t columns[DETECTOR_WIDTH];
static float numbers[DETECTOR_WIDTH]; /* one of each column */
#if DETECTOR_HAS_RANGES
static detector_range ranges[DETECTOR_WIDTH];
/* What the median remembers, which may be nothing; C has no array of nothing. */
static float state[DETECTOR_STATE_FLOATS(DETECTOR_WIDTH) + 1];
#endif

/* Prints the numbers under a name. Nine digits give a float back exactly. */
static void print_numbers(const char *name, size_t n)
{
    printf(", \"%s\": [", name);
    for (size_t i = 0; i < n; i++) {
        if (isfinite(numbers[i]))
            printf("%s%.9g", i ? ", " : "", numbers[i]);
        else
            printf("%snull", i ? ", " : "");
    }
    printf("]");
}

/* The same for one field of all ranges. */
#define PRINT_FIELD(name, field)             \
    do {                                     \
        for (size_t i = 0; i < n; i++)       \
            numbers[i] = ranges[i].field;    \
        print_numbers(name, n);              \
    } while (0)

static void print_frame(unsigned long frame, size_t n)
{
    printf("{\"frame\": %lu, \"columns\": [", frame);
    for (size_t i = 0; i < n; i++)
        printf("%s%d", i ? ", " : "", (int)columns[i]);
    printf("]");
#if DETECTOR_HAS_RANGES
    static const char *const status[] = {"obstacle", "none-in-view", "invalid"}; /* by DETECTOR_OBSTACLE and so on */
    PRINT_FIELD("rows", row);
    PRINT_FIELD("bearing", bearing);
    PRINT_FIELD("distance", distance);
    PRINT_FIELD("nearest", nearest);
    PRINT_FIELD("farthest", farthest);
    printf(", \"status\": [");
    for (size_t i = 0; i < n; i++)
        printf("%s\"%s\"", i ? ", " : "", status[ranges[i].status]);
    printf("]");
#else
    print_numbers("rows", n);
#endif
    printf("}\n");
}

/* Looks at n columns of the frame. Its pixels lie row by row without gaps; a camera's buffer may have other strides. */
static int look(size_t n)
{
#if DETECTOR_HAS_RANGES
    return detector_ranges(pixels, DETECTOR_WIDTH, 1, columns, n, state, ranges);
#else
    return detector_detect(pixels, DETECTOR_WIDTH, 1, columns, n, numbers);
#endif
}

int main(int argc, char **argv)
{
    frames in = {0};
    long n = 12;

    if (argc > 2) {
        fprintf(stderr, "usage: sonar [COLUMNS] < FRAMES\n");
        return 2;
    }
    if (argc == 2) {
        char *end;
        n = strtol(argv[1], &end, 10);
        if (end == argv[1] || *end || n < 1 || n > DETECTOR_WIDTH) {
            fprintf(stderr, "error: the number of columns has to be 1 to %d, not '%s'\n", DETECTOR_WIDTH, argv[1]);
            return 2;
        }
    }
    /* The image is cut into n strips of one width; the column in the middle of each is looked at. */
    for (long i = 0; i < n; i++)
        columns[i] = (int32_t)((2 * i + 1) * DETECTOR_WIDTH / (2 * n));
#if DETECTOR_HAS_RANGES
    detector_reset(state, (size_t)n);
#endif

    while (frames_next(&in, pixels)) {
        int error = look((size_t)n);
        if (error) {
            fprintf(stderr, "error: the detector refuses: %d, see detector.h\n", error);
            return 1;
        }
        print_frame(in.number - 1, (size_t)n);
        /* Whoever listens wants this frame now, not when a buffer is full. */
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
