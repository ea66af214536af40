/* One instance of the FMU. There are no global variables: an instance holds all its data. */

#ifndef INSTANCE_H
#define INSTANCE_H

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#include "fmi2_api.h"
#include "tables.h"

/* What the host learns where there is no result, unless the model knows the reason. */
#define NO_FINITE_RESULT "no finite result with these inputs and parameters"

/* The modes of an instance (FMI 2.0.4, sections 3.2.3 and 4.2.4), as bits, so that a set of modes is a number. */
typedef enum {
    INSTANTIATED = 1,
    INITIALISING = 2,
    EVENT_MODE = 4,
    CONTINUOUS_MODE = 8,
    STEPPING = 16, /* co-simulation, between two steps */
    TERMINATED = 32
} Phase;

enum { LOG_WARNING = 1, LOG_DISCARD = 2, LOG_ERROR = 4, LOG_FATAL = 8, LOG_ALL = 15 };

/* The contacts solved at one contact point with one set of coefficients. */
typedef struct {
    int known;
    double point[N_CONTACT_POINT], coefficients[N_COEFFICIENTS];
    double twist; /* of the contacts, without the compliance in series */
    double outputs[N_CONTACT];
} Contact;

/* Everything that changes during a simulation: the content of a saved FMU state. */
typedef struct {
    int kind; /* fmi2Type */
    int phase;
    int stale;
    int status; /* of the last step */
    double time, start; /* current time, and start time of the experiment */
    int stops; /* whether the experiment has a stop time */
    double stop;
    double next_discrete; /* next value of the discrete output, which changes at events only */
    double values[N_VALUES]; /* by value reference: inputs, outputs, parameters, states, derivatives */
    /* Model exchange: the stored angles at the end of the last integrator step, and the length of the path that the
       integrated speeds have given since the angles were last in agreement; see fmi2_model_exchange.c. */
    double last_path_values[N_INDICATORS + 1], path_from_speeds[N_INDICATORS + 1];
    Contact contact; /* of the last step: start value for the next one */
} InstanceState;

/* The callbacks and the log of the host. */
typedef struct {
    fmi2CallbackFunctions callbacks;
    const char *name;
    int categories; /* the log categories that are sent, as bits */
} HostLog;

/* Decoded tables: the lookup over quantity, twist and clearance; a missing element over twist, clearance, position. */
typedef struct {
#if HAS_CONTACT_FUNCTION
    char none; /* the generated functions contain the contacts */
#else
    double lookup[LOOKUP_QUANTITIES * LOOKUP_ROWS * LOOKUP_COLUMNS];
#endif
#if HAS_ELEMENT
    double element[ELEMENT_ROWS * ELEMENT_COLUMNS * ELEMENT_LAYERS];
#endif
} Tables;

typedef struct {
    InstanceState now;
    HostLog log;
    /* The coefficients, the longest substep, and the parameters from which they were computed. */
    int coefficients_known;
    double coefficient_parameters[N_PARAMETERS + 1], coefficients[N_COEFFICIENTS], max_step;
    /* Working memory. */
    int integers[N_INTEGERS];
    double next_states[2][N_STATES + 1]; /* used alternately: see next_states() */
    double next_outputs[N_OUTPUTS + 1];
    double direction[N_KNOWNS], tangent[N_UNKNOWNS];
#if HAS_START
    char refusal[200]; /* why the start was refused; empty for other reasons */
#endif
    double work[N_WORK];
    Tables tables;
} Instance;

enum {
    AT_INPUTS = 0,
    AT_OUTPUTS = AT_INPUTS + N_INPUTS,
    AT_PARAMETERS = AT_OUTPUTS + N_OUTPUTS,
    AT_STATES = AT_PARAMETERS + N_PARAMETERS,
    AT_RATES = AT_STATES + N_STATES
};

#endif
