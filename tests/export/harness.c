/* Runs exported detectors on images. The first argument is a file of pixels, the second where the answers go.
 * Every image lies in a block of its own that ends with its last pixel, with other bytes between the pixels and rows. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/*HEADERS*/

typedef int detect_fn(const uint8_t *, size_t, size_t, const int32_t *, size_t, float *);
typedef int ranges_fn(const uint8_t *, size_t, size_t, const int32_t *, size_t, float *, void *);
typedef void reset_fn(float *, size_t);

#define WITH_RANGES(name, up)                                                                              \
    static int name##_wrapped(const uint8_t *luma, size_t row, size_t pixel, const int32_t *columns, size_t n, \
                              float *state, void *out)                                                     \
    {                                                                                                      \
        return name##_ranges(luma, row, pixel, columns, n, up##_MEDIAN == 3 ? state : NULL, (name##_range *)out); \
    }                                                                                                      \
    static reset_fn *const name##_restart = name##_reset;
#define WITHOUT_RANGES(name)                     \
    static ranges_fn *const name##_wrapped = NULL; \
    static reset_fn *const name##_restart = NULL;

/*WRAPPERS*/

struct size { size_t width, height, images; };
static const struct size sizes[] = {
/*SIZES*/
};

static const uint8_t *first_pixel[sizeof sizes / sizeof *sizes];
static FILE *output;

static void look(detect_fn *detect, ranges_fn *ranges, reset_fn *reset, size_t set)
{
    const struct size *size = &sizes[set];
    const size_t n = (size->width + /*STEP*/ - 1) / /*STEP*/;
    int32_t *columns = malloc(n * sizeof *columns);
    float *rows = malloc(n * sizeof *rows), *state = malloc(2 * n * sizeof *state), *places = malloc(24 * n);
    size_t i, j, x, y;
    int pass;
    for (i = 0; i < n; i++)
        columns[i] = (int32_t)(i * /*STEP*/);
    if (reset)
        reset(state, n);
    for (pass = 0; pass < (ranges ? 2 : 1); pass++) {
        for (j = 0; j < size->images; j++) {
            const uint8_t *from = first_pixel[set] + j * size->width * size->height;
            const size_t pixel = 1 + j % 3, row = (size->width - 1) * pixel + 1 + j * 5 % 7;
            const size_t bytes = row * (size->height - 1) + (size->width - 1) * pixel + 1;
            uint8_t *luma = malloc(bytes);
            for (i = 0; i < bytes; i++)
                luma[i] = (uint8_t)(i * 37 + 11);
            for (y = 0; y < size->height; y++)
                for (x = 0; x < size->width; x++)
                    luma[y * row + x * pixel] = from[y * size->width + x];
            if (pass == 0) {
                if (detect(luma, row, pixel, columns, n, rows) != 0)
                    exit(3);
                fwrite(rows, sizeof *rows, n, output);
            } else {
                if (ranges(luma, row, pixel, columns, n, state, places) != 0)
                    exit(4);
                fwrite(places, 24, n, output);
            }
            free(luma);
        }
    }
    free(columns);
    free(rows);
    free(state);
    free(places);
}

int main(int argc, char **argv)
{
    size_t bytes = 0, i;
    uint8_t *pixels;
    FILE *input;
    if (argc != 3)
        return 2;
    for (i = 0; i < sizeof sizes / sizeof *sizes; i++)
        bytes += sizes[i].width * sizes[i].height * sizes[i].images;
    pixels = malloc(bytes);
    input = fopen(argv[1], "rb");
    output = fopen(argv[2], "wb");
    if (!pixels || !input || !output || fread(pixels, 1, bytes, input) != bytes)
        return 2;
    bytes = 0;
    for (i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        first_pixel[i] = pixels + bytes;
        bytes += sizes[i].width * sizes[i].height * sizes[i].images;
    }
#define DETECTOR(name, up, set) look(name##_detect, name##_wrapped, name##_restart, set);
/*DETECTORS*/
    free(pixels);
    fclose(input);
    return fclose(output) != 0;
}
