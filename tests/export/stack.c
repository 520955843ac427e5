/* Calls a detector on a stack whose bytes are known, and fails if it changes any that it does not state. */
#include "det.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>

#define BYTES ((size_t)1 << 20)
#define FRESH 0xa5
#if defined(__x86_64__)
#define STACK_POINTER "mov %%rsp, %0"
#elif defined(__aarch64__)
#define STACK_POINTER "mov %0, sp"
#elif defined(__riscv)
#define STACK_POINTER "mv %0, sp"
#else
#define STACK_POINTER "lgr %0, %%r15"
#endif

static uint8_t luma[DET_WIDTH * DET_HEIGHT];
static const int32_t columns[6] = {0, 1, 7, 12, 13, DET_WIDTH - 1};
static float rows[6], state[12];
static det_range ranges[6];
static ucontext_t here, there;
static int which;
static uint8_t *volatile top;

static void call(void)
{
    uint8_t *now;
    __asm__ volatile(STACK_POINTER : "=r"(now));
    top = now;
    switch (which) {
    case 0: det_detect(luma, DET_WIDTH, 1, columns, 6, rows); break;
    case 1: det_ranges(luma, DET_WIDTH, 1, columns, 6, state, ranges); break;
    case 2: det_reset(state, 6); break;
    default: det_info();
    }
}

int main(void)
{
    uint8_t *stack = malloc(BYTES);
    size_t i;
    if (stack == NULL)
        return 2;
    for (i = 0; i < sizeof luma; i++)
        luma[i] = (uint8_t)(i * i >> 3);
    /* The first round binds the functions, and does not count. */
    for (which = -1; which < 4; which++) {
        long taken;
        memset(stack, FRESH, BYTES);
        if (getcontext(&there) != 0)
            return 2;
        there.uc_stack.ss_sp = stack;
        there.uc_stack.ss_size = BYTES;
        there.uc_link = &here;
        makecontext(&there, call, 0);
        if (swapcontext(&here, &there) != 0)
            return 2;
        for (i = 0; i < BYTES && stack[i] == FRESH; i++) {
        }
        taken = (long)(top - &stack[i]);
        if (which >= 0 && taken > DET_STACK_BYTES) {
            printf("function %d takes %ld bytes of stack, not %d\n", which, taken, DET_STACK_BYTES);
            return 1;
        }
    }
    return 0;
}
