/* Plain C99, to be compiled as C and without options that change arithmetic. Nothing beside this file is needed.
 *
 * Every operation is IEEE 754 binary32, rounded to nearest even, with subnormals kept; then the answers are the same to
 * the bit on every processor. The checks below refuse what a compiler tells of options that break this. What none of
 * them tells of is left to you: do not give Clang -ffp-contract=fast or -funsafe-math-optimizations, and do not set the
 * processor to another rounding or to flush subnormals.
 */
#ifdef __cplusplus
#error "compile this file as C; its header serves C++ as well"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && !defined(__TINYC__)
/* GCC does not know the standard's way. The second keeps it from calling memset for loops. */
#pragma GCC optimize("fp-contract=off", "no-tree-loop-distribute-patterns")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#elif !defined(__TINYC__)
#pragma STDC FP_CONTRACT OFF
#endif
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__) || \
    defined(__NO_SIGNED_ZEROS__) || defined(_M_FP_FAST)
#error "compile this file without -ffast-math and its parts: they change the answers"
#endif
#if defined(__FINITE_MATH_ONLY__)
#if __FINITE_MATH_ONLY__
#error "compile this file without -ffinite-math-only: NaN and infinities are part of the language"
#endif
#endif
#include <float.h>
#if FLT_RADIX != 2 || FLT_MANT_DIG != 24 || FLT_MAX_EXP != 128
#error "float must be IEEE 754 binary32"
#endif
#if defined(FLT_EVAL_METHOD)
#if FLT_EVAL_METHOD != 0 && FLT_EVAL_METHOD != 16 /* 16: nothing but half precision is evaluated as it is */
#error "float must be evaluated as float: on x86 of 32 bits give -msse2 -mfpmath=sse"
#endif
#elif defined(__i386__) || defined(_M_IX86) || defined(__m68k__)
#error "this compiler may evaluate float with more precision"
#endif
/* Clang is kept from calling memset for a loop by an attribute of the function. */
#if !defined(VSONAR_NO_CALLS) && defined(__clang__)
#if __has_attribute(no_builtin)
#define VSONAR_NO_CALLS __attribute__((no_builtin))
#endif
#endif
#if !defined(VSONAR_NO_CALLS)
#define VSONAR_NO_CALLS
#endif
