/* One instance of the FMU. Nothing is global: what an instance knows stands here. */

#ifndef INSTANCE_H
#define INSTANCE_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2_api.h"
#include "model.h"

/* The states of an instance (FMI 2.0.4, sections 3.2.3 and 4.2.4), as bits so that a set of them is a number. */
typedef enum {
    INSTANTIATED = 1,
    INITIALISING = 2,
    EVENT_MODE = 4,
    CONTINUOUS_MODE = 8,
    STEPPING = 16, /* co-simulation, between two steps */
    TERMINATED = 32
} Phase;

enum { LOG_WARNING = 1, LOG_DISCARD = 2, LOG_ERROR = 4, LOG_FATAL = 8, LOG_ALL = 15 };

/* All that changes: what a saved FMU state holds. */
typedef struct {
    int kind; /* fmi2Type */
    int phase;
    int stale;
    int status; /* of the last step */
    double time;
    double values[N_VALUES]; /* by value reference: inputs, outputs, parameters, states, derivatives */
} Content;

/* The way to the host. */
typedef struct {
    fmi2CallbackFunctions callbacks;
    const char *name;
    int log; /* categories that are sent */
} Voice;

typedef struct {
    Content now;
    Voice voice;
    /* Work space of the generated functions. */
    const double *arguments[N_ARGUMENTS];
    double *results[N_RESULTS];
    int integers[N_INTEGERS];
    double next_states[2][N_STATES + 1]; /* two in turn: a generated function may not read where it writes */
    double next_outputs[N_OUTPUTS + 1];
    double direction[N_KNOWNS], tangent[N_UNKNOWNS];
    double work[N_WORK];
} Instance;

enum {
    AT_INPUTS = 0,
    AT_OUTPUTS = AT_INPUTS + N_INPUTS,
    AT_PARAMETERS = AT_OUTPUTS + N_OUTPUTS,
    AT_STATES = AT_PARAMETERS + N_PARAMETERS,
    AT_RATES = AT_STATES + N_STATES
};

#endif
