/* Reads gray frames of the detector's size from standard input: raw pixels, a byte each, or Y4M of 8 bits, of which the
 * luma is taken. What is wrong with the input ends the program with exit code 1. */
#ifndef FRAMES_H
#define FRAMES_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "detector.h"

#define FRAME_PIXELS ((size_t)DETECTOR_WIDTH * DETECTOR_HEIGHT)

/* Where in the input we are. All zero at the beginning. */
typedef struct frames {
    unsigned long number; /* frames read */
    int is_y4m;
    size_t chroma_bytes; /* of colour after each frame's luma */
} frames;

static void frames_fail(const frames *in, const char *message)
{
    fprintf(stderr, "error: frame %lu: %s\n", in->number, message);
    exit(1);
}

/* Reads up to n bytes; fewer only at the end of the input. */
static size_t frames_bytes(uint8_t *to, size_t n)
{
    size_t got = fread(to, 1, n, stdin);
    if (got < n && ferror(stdin)) {
        fprintf(stderr, "error: cannot read standard input: %s\n", strerror(errno));
        exit(1);
    }
    return got;
}

/* Reads the rest of a line of Y4M, without its end. */
static void frames_line(const frames *in, char *line, size_t size)
{
    size_t n = 0;
    uint8_t c;
    for (;;) {
        if (frames_bytes(&c, 1) == 0)
            frames_fail(in, "the input ends in a header of Y4M");
        if (c == '\n')
            break;
        if (c == 0 || n + 1 == size)
            frames_fail(in, "this is no header of Y4M");
        line[n++] = (char)c;
    }
    line[n] = 0;
}

/* Reads the header of Y4M: words, the first letter of each says what it gives. */
static void frames_y4m(frames *in)
{
    const size_t half_width = (DETECTOR_WIDTH + 1) / 2, half_height = (DETECTOR_HEIGHT + 1) / 2;
    const char *form = "420"; /* what it is where nothing is said */
    unsigned long width = 0, height = 0;
    char line[1024];

    frames_line(in, line, sizeof line);
    for (char *word = strtok(line, " "); word; word = strtok(NULL, " ")) {
        if (word[0] == 'W')
            width = strtoul(word + 1, NULL, 10);
        else if (word[0] == 'H')
            height = strtoul(word + 1, NULL, 10);
        else if (word[0] == 'C')
            form = word + 1;
    }
    if (width != DETECTOR_WIDTH || height != DETECTOR_HEIGHT) {
        fprintf(stderr, "error: the frames are of %lu x %lu pixels, but the detector is for %d x %d: scale them\n", width,
            height, DETECTOR_WIDTH, DETECTOR_HEIGHT);
        exit(1);
    }
    if (!strcmp(form, "mono")) {
        in->chroma_bytes = 0;
    } else if (!strcmp(form, "420") || !strcmp(form, "420jpeg") || !strcmp(form, "420mpeg2") ||
               !strcmp(form, "420paldv")) {
        in->chroma_bytes = 2 * half_width * half_height;
    } else if (!strcmp(form, "422")) {
        in->chroma_bytes = 2 * half_width * DETECTOR_HEIGHT;
    } else if (!strcmp(form, "444")) {
        in->chroma_bytes = 2 * FRAME_PIXELS;
    } else {
        fprintf(stderr, "error: Y4M of the form C%s: convert it to Cmono, C420, C422 or C444, of 8 bits\n", form);
        exit(1);
    }
    in->is_y4m = 1;
}

/* Reads the next frame, row by row without gaps. Returns 0 where the input has ended. */
static int frames_next(frames *in, uint8_t pixels[FRAME_PIXELS])
{
    static const char file_begins[10] = "YUV4MPEG2 ", frame_begins[5] = "FRAME";
    char line[1024];
    size_t got = 0;

    if (in->number == 0) {
        /* Ten pixels, unless they spell the name of Y4M. No detector is for images as small as that. */
        got = frames_bytes(pixels, sizeof file_begins);
        if (got == sizeof file_begins && !memcmp(pixels, file_begins, got)) {
            frames_y4m(in);
            got = 0;
        }
    }
    if (in->is_y4m) {
        got = frames_bytes(pixels, sizeof frame_begins);
        if (got == 0)
            return 0;
        if (got < sizeof frame_begins || memcmp(pixels, frame_begins, got))
            frames_fail(in, "this is not where a frame of Y4M begins");
        frames_line(in, line, sizeof line);
        got = 0;
    }
    got += frames_bytes(pixels + got, FRAME_PIXELS - got);
    if (got == 0 && !in->is_y4m)
        return 0;
    if (got < FRAME_PIXELS)
        frames_fail(in, "the input ends before its last pixel");
    for (size_t left = in->chroma_bytes; left > 0;) {
        uint8_t colour[4096];
        size_t n = left < sizeof colour ? left : sizeof colour;
        if (frames_bytes(colour, n) < n)
            frames_fail(in, "the input ends before its last colour");
        left -= n;
    }
    in->number++;
    return 1;
}

#endif
