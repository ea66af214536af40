/* Model exchange (FMI 2.0.4, section 3.2). The model is autonomous: the time serves the host only. */

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2EnterEventMode)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed_for(instance, &CALL_EnterEventMode, fmi2ModelExchange)) return fmi2Error;
    instance->now.phase = EVENT_MODE;
    instance->now.stale |= STALE_OUTPUTS;
    return fmi2OK;
}

/* Whether an angle is ahead of the value that a state stores, because the host connects the angle without its speed or
   lets it jump. Friction and everything else that follows the angle then catches up at an event, over the missing part
   of the path, as in a step of co-simulation. A difference below a millionth of the state's nominal value, or shorter
   than the path that the integrated speeds have given, is an error of the integrator. If the result is 1, the states
   after the event are in instance->next_states[0]. */
static int angle_is_ahead(Instance *instance) {
    int found = 0;
#if HAS_ANGLE_STATES && !IS_JOINT
    double next[N_STATES], x[N_STATES];
    Evaluation at;
    memcpy(x, instance->now.values + AT_STATES, N_STATES * sizeof(double));
    update_coefficients(instance);
    begin_evaluation(instance, &at, x);
    follow_angles(instance, &at);
    memcpy(next, at.x, N_STATES * sizeof(double));
    for (int k = 0; k < N_INDICATORS; k++) {
        int state = FIRST_INDICATOR + k;
        double lead = fabs(next[state] - x[state]);
        if (lead > fmax(1e-6 * VARIABLES[AT_STATES + state].nominal, instance->now.path_from_speeds[k])) found = 1;
        else x[state] = next[state];
    }
    if (found) {
        begin_evaluation(instance, &at, x);
        follow_angles(instance, &at);
        found = all_finite(at.x, N_STATES);
        memmove(instance->next_states[0], at.x, N_STATES * sizeof(double));
    }
#else
    (void)instance;
#endif
    return found;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2NewDiscreteStates)(fmi2Component component, fmi2EventInfo *info) {
    Instance *instance = component;
    if (!allowed_for(instance, &CALL_NewDiscreteStates, fmi2ModelExchange) ||
        !has_array(instance, &CALL_NewDiscreteStates, info, 1))
        return fmi2Error;
    /* There are no discrete states: an event changes the sign of a speed, and with it the derivatives. */
    memset(info, 0, sizeof *info);
    if (angle_is_ahead(instance)) {
        memcpy(instance->now.values + AT_STATES, instance->next_states[0], N_STATES * sizeof(double));
        instance->now.stale |= STALE_OUTPUTS | STALE_RATES;
        info->valuesOfContinuousStatesChanged = fmi2True;
        accumulate_path(instance);
        memset(instance->now.path_from_speeds, 0, sizeof instance->now.path_from_speeds);
    }
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2EnterContinuousTimeMode)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed_for(instance, &CALL_EnterContinuousTimeMode, fmi2ModelExchange)) return fmi2Error;
    refresh(instance, STALE_OUTPUTS); /* for the discrete output; a failure is reported by the next call */
    instance->now.phase = CONTINUOUS_MODE;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2CompletedIntegratorStep)(fmi2Component component, fmi2Boolean no_return,
                                                              fmi2Boolean *event, fmi2Boolean *terminate) {
    Instance *instance = component;
    (void)no_return;
    if (!allowed_for(instance, &CALL_CompletedIntegratorStep, fmi2ModelExchange) ||
        !has_array(instance, &CALL_CompletedIntegratorStep, event, 1) ||
        !has_array(instance, &CALL_CompletedIntegratorStep, terminate, 1) ||
        !before_stop_time(instance, &CALL_CompletedIntegratorStep, instance->now.time, 0.0))
        return fmi2Error;
    *event = *terminate = fmi2False;
    accumulate_path(instance);
    if (refresh(instance, STALE_OUTPUTS))
        *event = instance->now.next_discrete != instance->now.values[AT_OUTPUTS + DISCRETE_OUTPUT] ||
                 angle_is_ahead(instance);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetTime)(fmi2Component component, fmi2Real time) {
    Instance *instance = component;
    if (!allowed_for(instance, &CALL_SetTime, fmi2ModelExchange)) return fmi2Error;
    if (!all_finite(&time, 1)) {
        report(instance, fmi2Discard, "%s: expected a finite time, got %g s", CALL_SetTime.name, time);
        return fmi2Discard;
    }
    /* CVode steps beyond the end and interpolates; FMPy limits its steps to a fiftieth of the run. */
    if (!before_stop_time(instance, &CALL_SetTime, time, (instance->now.stop - instance->now.start) / 50.0))
        return fmi2Error;
    instance->now.time = time;
    return fmi2OK;
}

/* Whether the call is allowed and its vector has the length of the model. */
static int has_length(const Instance *instance, const Call *call, const void *array, size_t came, size_t expected) {
    if (!allowed_for(instance, call, fmi2ModelExchange) || !has_array(instance, call, array, came)) return 0;
    if (came == expected) return 1;
    report(instance, fmi2Error, "%s: expected %lu values, got %lu", call->name, (unsigned long)expected,
           (unsigned long)came);
    return 0;
}

static fmi2Status discard(const Instance *instance, const Call *call) {
    report(instance, fmi2Discard, "%s: %s", call->name, no_result(instance));
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetContinuousStates)(fmi2Component component, const fmi2Real states[],
                                                          size_t count) {
    Instance *instance = component;
    if (!has_length(instance, &CALL_SetContinuousStates, states, count, N_STATES)) return fmi2Error;
    if (!all_finite(states, count)) {
        report(instance, fmi2Discard, "%s: expected finite states", CALL_SetContinuousStates.name);
        return fmi2Discard;
    }
    if (count) memcpy(instance->now.values + AT_STATES, states, count * sizeof(double));
    instance->now.stale |= STALE_OUTPUTS | STALE_RATES;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetDerivatives)(fmi2Component component, fmi2Real derivatives[], size_t count) {
    Instance *instance = component;
    if (!has_length(instance, &CALL_GetDerivatives, derivatives, count, N_STATES)) return fmi2Error;
    if (!refresh(instance, STALE_RATES)) return discard(instance, &CALL_GetDerivatives);
    if (count) memcpy(derivatives, instance->now.values + AT_RATES, count * sizeof(double));
    return fmi2OK;
}

/* The speeds whose signs determine the direction of friction: where one crosses zero, derivatives are discontinuous. */
FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetEventIndicators)(fmi2Component component, fmi2Real indicators[],
                                                         size_t count) {
    Instance *instance = component;
    if (!has_length(instance, &CALL_GetEventIndicators, indicators, count, N_INDICATORS)) return fmi2Error;
    if (!refresh(instance, STALE_RATES)) return discard(instance, &CALL_GetEventIndicators);
    if (count) memcpy(indicators, instance->now.values + AT_RATES + FIRST_INDICATOR, count * sizeof(double));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetContinuousStates)(fmi2Component component, fmi2Real states[], size_t count) {
    Instance *instance = component;
    if (!has_length(instance, &CALL_GetContinuousStates, states, count, N_STATES)) return fmi2Error;
    if (!refresh(instance, 0)) return discard(instance, &CALL_GetContinuousStates);
    if (count) memcpy(states, instance->now.values + AT_STATES, count * sizeof(double));
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetNominalsOfContinuousStates)(fmi2Component component, fmi2Real nominals[],
                                                                    size_t count) {
    Instance *instance = component;
    if (!has_length(instance, &CALL_GetNominalsOfContinuousStates, nominals, count, N_STATES)) return fmi2Error;
    for (size_t k = 0; k < count; k++) nominals[k] = VARIABLES[(AT_STATES + k) % N_VALUES].nominal;
    return fmi2OK;
}
