/* One instance of the FMU. Nothing is global: what an instance knows stands here. */

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

/* What the contacts give at a point. */
typedef struct {
    int known;
    double at[N_CONTACT_POINT], coefficients[N_COEFFICIENTS];
    double twist; /* of the contacts alone */
    double outputs[N_CONTACT];
} Contact;

/* All that changes: what a saved FMU state holds. */
typedef struct {
    int kind; /* fmi2Type */
    int phase;
    int stale;
    int status; /* of the last step */
    double time, start; /* and where the experiment begins and, if `stops`, ends */
    int stops;
    double stop;
    double next_discrete; /* of the discrete output, which changes at events only */
    double values[N_VALUES]; /* by value reference: inputs, outputs, parameters, states, derivatives */
    double last_path_values[N_INDICATORS + 1], path_from_speeds[N_INDICATORS + 1]; /* of angles, see fmi2_model_exchange.c */
    Contact contact; /* of the last step: where the next one starts to search */
} InstanceState;

/* The way to the host. */
typedef struct {
    fmi2CallbackFunctions callbacks;
    const char *name;
    int categories; /* categories that are sent */
} HostLog;

/* The lookup by quantity, twist and clearance; the missing element by twist, clearance and position. */
typedef struct {
#if IS_INDIVIDUAL
    char none; /* of the lookup: its parts stand in the generated functions */
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
    /* The coefficients and the parameters that they were computed from. */
    int coefficients_known;
    double coefficient_parameters[N_PARAMETERS + 1], coefficients[N_COEFFICIENTS], max_step;
    /* Work space. */
    int integers[N_INTEGERS];
    double next_states[2][N_STATES + 1]; /* two in turn: a generated function may not read where it writes */
    double next_outputs[N_OUTPUTS + 1];
    double direction[N_KNOWNS], tangent[N_UNKNOWNS];
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
