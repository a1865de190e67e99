/* FMI 2.0 co-simulation FMU of one imufmu block.

   The only file to compile, as C99 or as C++17. It includes the others, in reading order, into one translation unit: everything but the FMI
   functions is static, so no name meets one of the host, of a library or of another FMU. block.c and equations.c are
   generated from the declaration of the block; the rest is the same for all blocks.

   Nothing is global but constants, and nothing is allocated between fmi2Instantiate and fmi2FreeInstance but the states
   that the host asks for. So instances can run in different threads. */

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "prefix.h"

/* The same rounding on every processor. GCC does not know this; there it is -ffp-contract=off. */
#if defined(__clang__) || !defined(__GNUC__)
#pragma STDC FP_CONTRACT OFF
#endif

#include "variable.h"
#include "block.c"

/* CasADi writes functions and arguments that are not always used, and conditions as numbers. */
#ifdef __GNUC__
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wfloat-conversion"
#endif
#define CASADI_SYMBOL_EXPORT static
#include "equations.c"
#ifdef __GNUC__
#pragma GCC diagnostic pop
#endif

#include "instance.c"
#include "noise.c"
#if SAMPLED
#include "sampled.c"
#else
#include "continuous.c"
#endif
#include "checks.c"
#include "fmi2_lifecycle.c"
#include "fmi2_variables.c"
#include "fmi2_step.c"
#include "fmi2_state.c"
