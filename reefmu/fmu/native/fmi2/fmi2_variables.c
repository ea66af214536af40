/* Reading and writing variables (FMI 2.0.4, section 2.1.7). All variables are Real. */

static fmi2Status no_variable(const Instance *instance, const Call *call, fmi2ValueReference reference) {
    report(instance, fmi2Error, "%s: expected the value reference of a variable, %d to %d, got %u", call->name,
           (int)FIRST_REFERENCE, (int)(FIRST_REFERENCE + N_VALUES - 1), reference);
    return fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetReal)(fmi2Component component, const fmi2ValueReference references[],
                                              size_t count, fmi2Real values[]) {
    Instance *instance = component;
    int wanted = 0;
    if (!allowed(instance, &CALL_GetReal) || !has_array(instance, &CALL_GetReal, references, count) ||
        !has_array(instance, &CALL_GetReal, values, count))
        return fmi2Error;
    for (size_t k = 0; k < count; k++) {
        size_t index = index_of(references[k]);
        if (index == N_VALUES) return no_variable(instance, &CALL_GetReal, references[k]);
        wanted |= VARIABLES[index].stale;
    }
    if (instance->now.stale & wanted && !refresh(instance, wanted)) {
        for (size_t k = 0; k < count; k++) {
            size_t index = index_of(references[k]);
            values[k] = VARIABLES[index].stale ? NAN : instance->now.values[index];
        }
        report(instance, fmi2Discard, "%s: %s", CALL_GetReal.name, no_result(instance));
        return fmi2Discard;
    }
    for (size_t k = 0; k < count; k++) values[k] = instance->now.values[index_of(references[k])];
    return fmi2OK;
}

/* The modes in which a variable may be set; in all others the call is an error (sections 2.2.7, 3.2.3, 4.2.4). Single
   states may be set in model exchange (section 3.1, table; FMI 3.0.2, section 3.2.1), but not before, because their
   start values are calculated. */
static const int SETTABLE[] = {
    [RESULT] = 0,
    [INPUT] = INSTANTIATED | INITIALISING | RUNNING,
    [TUNABLE] = INSTANTIATED | INITIALISING | EVENT_MODE | STEPPING,
    [FIXED] = INSTANTIATED | INITIALISING,
    [STATE] = EVENT_MODE | CONTINUOUS_MODE,
};

/* Sets all values or none: fmi2Discard for a value out of range, fmi2Error for an illegal call. */
FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetReal)(fmi2Component component, const fmi2ValueReference references[],
                                              size_t count, const fmi2Real values[]) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_SetReal) || !has_array(instance, &CALL_SetReal, references, count) ||
        !has_array(instance, &CALL_SetReal, values, count))
        return fmi2Error;
    for (size_t k = 0; k < count; k++) {
        const Variable *variable = &VARIABLES[index_of(references[k]) % N_VALUES];
        if (index_of(references[k]) == N_VALUES) return no_variable(instance, &CALL_SetReal, references[k]);
        if (!(SETTABLE[variable->access] & instance->now.phase)) {
            report(instance, fmi2Error, "%s: %s cannot be set in this mode (%s)", CALL_SetReal.name, variable->name,
                   phase_name(instance->now.phase));
            return fmi2Error;
        }
        if (!(values[k] >= variable->low && values[k] <= variable->high)) { /* true for NaN */
            report(instance, fmi2Discard, "%s: expected a finite number from %g to %g [%s], got %g", variable->name,
                   variable->low, variable->high, variable->unit, values[k]);
            return fmi2Discard;
        }
    }
    for (size_t k = 0; k < count; k++) instance->now.values[index_of(references[k])] = values[k];
    if (!count) return fmi2OK;
    /* Between two steps the outputs remain those of the last step (section 4.2.4). */
    if (instance->now.phase & (INSTANTIATED | INITIALISING)) instance->now.stale = STALE_ALL;
    else if (instance->now.phase == STEPPING) instance->now.stale |= STALE_RATES;
    else instance->now.stale |= STALE_OUTPUTS | STALE_RATES;
    return fmi2OK;
}

/* No variable has these types: an empty list is accepted, anything else is an error. */
#define NO_VARIABLES(function, type)                                                                           \
    FMI2_EXPORT fmi2Status FMI2_NAME(function)(fmi2Component component, const fmi2ValueReference references[], \
                                               size_t count, type values[]) {                                  \
        (void)references;                                                                                      \
        (void)values;                                                                                          \
        if (component && !count) return fmi2OK;                                                                \
        if (component) report(component, fmi2Error, #function ": this FMU has Real variables only");           \
        return fmi2Error;                                                                                      \
    }
NO_VARIABLES(fmi2GetInteger, fmi2Integer)
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetInteger, const fmi2Integer)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)
