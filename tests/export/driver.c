/* Checks the interface of the detector `det`. The exit status is the line of the first check that fails, modulo 256. */
#include "det.h"

#include <stdio.h>
#include <string.h>

#define CHECK(holds) do { if (!(holds)) { fprintf(stderr, "driver.c:%d: %s\n", __LINE__, #holds); return 1; } } while (0)
#define W DET_WIDTH
#define H DET_HEIGHT

static uint8_t luma[W * H];

int main(void)
{
    const int32_t good[3] = {0, W - 1, 7}, low[3] = {0, -1, 7}, high[3] = {W, 0, 7};
    float rows[3] = {1, 2, 3}, first[3], second[3], state[DET_STATE_FLOATS(3) + 1];
    det_range ranges[3];
    const det_info_t *info = det_info();
    const size_t most = (size_t)PTRDIFF_MAX, floats = DET_STATE_FLOATS(3);
    size_t i;

    /* Nothing to do. */
    CHECK(det_detect(NULL, 0, 0, NULL, 0, NULL) == 0);
    CHECK(det_ranges(NULL, 0, 0, NULL, 0, NULL, NULL) == 0);
    /* A null pointer comes before the strides, these before the columns. */
    CHECK(det_detect(NULL, 0, 0, low, 3, rows) == DET_ERROR_NULL);
    CHECK(det_detect(luma, 0, 0, NULL, 3, rows) == DET_ERROR_NULL);
    CHECK(det_detect(luma, 0, 0, low, 3, NULL) == DET_ERROR_NULL);
    CHECK(det_detect(luma, 0, 0, low, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, W - 1, 1, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, W, 0, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, 3 * (W - 1), 3, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, most, most / W + 1, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, SIZE_MAX, SIZE_MAX, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, most / H + 1, 1, good, 3, rows) == DET_ERROR_STRIDE);
    CHECK(det_detect(luma, most / H, 1, low, 3, rows) == DET_ERROR_COLUMN);
    CHECK(det_detect(luma, most / H, (most / H - 1) / (W - 1), low, 3, rows) == DET_ERROR_COLUMN);
    CHECK(det_detect(luma, W, 1, low, 3, rows) == DET_ERROR_COLUMN);
    CHECK(det_detect(luma, W, 1, high, 3, rows) == DET_ERROR_COLUMN);
    CHECK(rows[0] == 1 && rows[1] == 2 && rows[2] == 3);

    /* The same with ranges; refused calls leave the state alone. */
    for (i = 0; i < floats + 1; i++)
        state[i] = (float)i;
    CHECK(det_ranges(NULL, W, 1, good, 3, state, ranges) == DET_ERROR_NULL);
    CHECK(det_ranges(luma, W, 1, NULL, 3, state, ranges) == DET_ERROR_NULL);
    CHECK(det_ranges(luma, 0, 1, good, 3, state, NULL) == DET_ERROR_NULL);
    CHECK(det_ranges(luma, 0, 1, good, 3, NULL, ranges) == (DET_MEDIAN == 3 ? DET_ERROR_NULL : DET_ERROR_STRIDE));
    CHECK(det_ranges(luma, W - 1, 1, low, 3, state, ranges) == DET_ERROR_STRIDE);
    CHECK(det_ranges(luma, W, 1, low, 3, state, ranges) == DET_ERROR_COLUMN);
    for (i = 0; i < floats + 1; i++)
        CHECK(state[i] == (float)i);

    /* The state holds the rows of the last two frames. */
    det_reset(state, 3);
    for (i = 0; i < floats; i++)
        CHECK(state[i] != state[i]);
    CHECK(state[floats] == (float)floats);
    for (i = 0; i < sizeof luma; i++)
        luma[i] = (uint8_t)(i * i >> 3);
    CHECK(det_detect(luma, W, 1, good, 3, first) == 0);
    CHECK(det_ranges(luma, W, 1, good, 3, DET_MEDIAN == 3 ? state : NULL, ranges) == 0);
    for (i = 0; i < 3; i++) {
        CHECK(first[i] == first[i]);
        CHECK(ranges[i].row == first[i]);
        if (DET_MEDIAN == 3)
            CHECK(state[2 * i] == first[i] && state[2 * i + 1] != state[2 * i + 1]);
    }
    for (i = 0; i < sizeof luma; i++)
        luma[i] = (uint8_t)(i * 11 % 251);
    CHECK(det_detect(luma, W, 1, good, 3, second) == 0);
    CHECK(det_ranges(luma, W, 1, good, 3, DET_MEDIAN == 3 ? state : NULL, ranges) == 0);
    CHECK(first[0] != second[0]);
    for (i = 0; i < 3 && DET_MEDIAN == 3; i++)
        CHECK(state[2 * i] == second[i] && state[2 * i + 1] == first[i]);

    /* What the detector says of itself. */
    CHECK(info->abi == DET_ABI && info->width == W && info->height == H);
    CHECK(info->median == DET_MEDIAN && info->has_ranges == DET_HAS_RANGES && DET_HAS_RANGES == 1);
    CHECK(info->correct == 391 && info->cases == 426);
    CHECK(info->has_seed == 1 && info->seed == UINT64_MAX);
    CHECK(strcmp(info->version, DET_VSONAR_VERSION) == 0 && strcmp(info->name, "det") == 0);
    CHECK(strcmp(info->data, DET_DATA) == 0 && DET_SEED == info->seed && DET_CORRECT == 391 && DET_CASES == 426);
    CHECK(DET_STACK_BYTES == 12345 && DET_CAMERA_PITCH == 51.0);
    fwrite(info->data, 1, strlen(info->data) + 1, stdout);
    fwrite(info->program, 1, strlen(info->program) + 1, stdout);
    return 0;
}
