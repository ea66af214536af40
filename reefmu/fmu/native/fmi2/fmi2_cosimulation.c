/* Co-simulation (FMI 2.0.4, section 4.2). Inputs are constant over a step, of any length. */

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2DoStep)(fmi2Component component, fmi2Real time, fmi2Real dt,
                                             fmi2Boolean no_return) {
    Instance *instance = component;
    const char *problem = NULL;
    (void)no_return;
    if (!allowed_for(instance, &CALL_DoStep, fmi2CoSimulation) ||
        !before_stop_time(instance, &CALL_DoStep, time + dt, 0.0))
        return fmi2Error;
    if (!(dt > 0.0 && dt < HUGE_VAL) || !all_finite(&time, 1)) problem = "expected a finite time and a step above 0 s";
    else if (!refresh(instance, 0) || !advance_step(instance, dt))
        problem = no_result(instance);
    if (problem) {
        instance->now.status = fmi2Discard;
        report(instance, fmi2Discard, "step of %g s at %g s discarded: %s", dt, time, problem);
        return fmi2Discard;
    }
    instance->now.time = time + dt;
    instance->now.status = fmi2OK;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2CancelStep)(fmi2Component component) {
    allowed_for(component, &CALL_CancelStep, fmi2CoSimulation);
    return fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetRealInputDerivatives)(fmi2Component component,
                                                              const fmi2ValueReference references[], size_t count,
                                                              const fmi2Integer orders[], const fmi2Real values[]) {
    (void)references, (void)count, (void)orders, (void)values;
    /* FMI 3.0 has no such function. */
    if (component) report(component, fmi2Error, "fmi2SetRealInputDerivatives: inputs are constant over a step");
    return fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetRealOutputDerivatives)(fmi2Component component,
                                                               const fmi2ValueReference references[], size_t count,
                                                               const fmi2Integer orders[], fmi2Real values[]) {
    (void)references, (void)count, (void)orders, (void)values;
    /* FMI 3.0 refuses its counterpart in fmi3_unsupported.c. */
    if (component) report(component, fmi2Error, "fmi2GetRealOutputDerivatives: outputs have no derivatives");
    return fmi2Error;
}

static int status_call(const Instance *instance, const void *value) {
    return allowed_for(instance, &CALL_GetStatus, fmi2CoSimulation) && has_array(instance, &CALL_GetStatus, value, 1);
}

static fmi2Status no_status(const Instance *instance) {
    report(instance, fmi2Discard, "%s: this kind of status is not available", CALL_GetStatus.name);
    return fmi2Discard;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetStatus)(fmi2Component component, fmi2StatusKind kind, fmi2Status *value) {
    Instance *instance = component;
    if (!status_call(instance, value)) return fmi2Error;
    if (kind != fmi2DoStepStatus) return no_status(instance);
    *value = (fmi2Status)instance->now.status;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetRealStatus)(fmi2Component component, fmi2StatusKind kind, fmi2Real *value) {
    Instance *instance = component;
    if (!status_call(instance, value)) return fmi2Error;
    if (kind != fmi2LastSuccessfulTime) return no_status(instance);
    *value = instance->now.time;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetIntegerStatus)(fmi2Component component, fmi2StatusKind kind,
                                                       fmi2Integer *value) {
    (void)kind;
    return status_call(component, value) ? no_status(component) : fmi2Error;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetBooleanStatus)(fmi2Component component, fmi2StatusKind kind,
                                                       fmi2Boolean *value) {
    if (!status_call(component, value)) return fmi2Error;
    if (kind != fmi2Terminated) return no_status(component);
    *value = fmi2False;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetStringStatus)(fmi2Component component, fmi2StatusKind kind,
                                                      fmi2String *value) {
    (void)kind;
    return status_call(component, value) ? no_status(component) : fmi2Error;
}
