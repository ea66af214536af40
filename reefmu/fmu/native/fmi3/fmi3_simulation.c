/* Co-simulation and model exchange (FMI 3.0.2, sections 3.2 and 4.2). */

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3DoStep)(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step,
                                             fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate,
                                             fmi3Boolean *early, fmi3Float64 *reached) {
    fmi2Status status;
    if (!instance) return fmi3Error;
    status = FMI2_NAME(fmi2DoStep)(CORE(instance), time, step, no_return);
    if (event) *event = false;
    if (terminate) *terminate = false;
    if (early) *early = false;
    if (reached) *reached = ((const Instance *)CORE(instance))->now.time;
    return (fmi3Status)status;
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3UpdateDiscreteStates)(fmi3Instance instance, fmi3Boolean *again,
                                                           fmi3Boolean *terminate, fmi3Boolean *nominals,
                                                           fmi3Boolean *values, fmi3Boolean *has_next,
                                                           fmi3Float64 *next) {
    fmi2EventInfo info;
    fmi2Status status;
    status = FMI2_NAME(fmi2NewDiscreteStates)(CORE(instance), &info);
    if (status != fmi2OK) return (fmi3Status)status;
    if (again) *again = info.newDiscreteStatesNeeded != 0;
    if (terminate) *terminate = info.terminateSimulation != 0;
    if (nominals) *nominals = info.nominalsOfContinuousStatesChanged != 0;
    if (values) *values = info.valuesOfContinuousStatesChanged != 0;
    if (has_next) *has_next = info.nextEventTimeDefined != 0;
    if (next) *next = info.nextEventTime;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3CompletedIntegratorStep)(fmi3Instance instance, fmi3Boolean no_return,
                                                              fmi3Boolean *event, fmi3Boolean *terminate) {
    fmi2Boolean answers[2];
    fmi2Status status =
        FMI2_NAME(fmi2CompletedIntegratorStep)(CORE(instance), no_return, &answers[0], &answers[1]);
    if (status != fmi2OK) return (fmi3Status)status;
    if (event) *event = answers[0] != 0;
    if (terminate) *terminate = answers[1] != 0;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetTime)(fmi3Instance instance, fmi3Float64 time) {
    return (fmi3Status)FMI2_NAME(fmi2SetTime)(CORE(instance), time);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetContinuousStates)(fmi3Instance instance, const fmi3Float64 states[],
                                                          size_t count) {
    return (fmi3Status)FMI2_NAME(fmi2SetContinuousStates)(CORE(instance), states, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetContinuousStateDerivatives)(fmi3Instance instance, fmi3Float64 derivatives[],
                                                                    size_t count) {
    return (fmi3Status)FMI2_NAME(fmi2GetDerivatives)(CORE(instance), derivatives, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetEventIndicators)(fmi3Instance instance, fmi3Float64 indicators[],
                                                         size_t count) {
    return (fmi3Status)FMI2_NAME(fmi2GetEventIndicators)(CORE(instance), indicators, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetContinuousStates)(fmi3Instance instance, fmi3Float64 states[], size_t count) {
    return (fmi3Status)FMI2_NAME(fmi2GetContinuousStates)(CORE(instance), states, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetNominalsOfContinuousStates)(fmi3Instance instance, fmi3Float64 nominals[],
                                                                    size_t count) {
    return (fmi3Status)FMI2_NAME(fmi2GetNominalsOfContinuousStates)(CORE(instance), nominals, count);
}

static fmi3Status number(fmi3Instance instance, size_t *count, size_t value) {
    if (!instance || !count) return fmi3Error;
    *count = value;
    return fmi3OK;
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetNumberOfEventIndicators)(fmi3Instance instance, size_t *count) {
    return number(instance, count, N_INDICATORS);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetNumberOfContinuousStates)(fmi3Instance instance, size_t *count) {
    return number(instance, count, N_STATES);
}
