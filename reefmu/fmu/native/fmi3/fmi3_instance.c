/* Instances and logging (FMI 3.0.2, sections 2.2.1 and 2.3.1 to 2.3.3). */

typedef struct {
    fmi2Component core;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} Fmi3Instance;

#define CORE(instance) ((instance) ? ((Fmi3Instance *)(instance))->core : NULL)

/* Forwards a message of the FMI 2.0 instance; it is complete, not a format string. */
static void forward_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                            fmi2String category, fmi2String message, ...) {
    const Fmi3Instance *instance = environment;
    (void)name;
    if (instance->log) instance->log(instance->environment, (fmi3Status)status, category, message);
}

static void log_error(fmi3Instance instance, const char *message) {
    if (instance) report(CORE(instance), fmi2Error, "%s", message);
}

static fmi3Instance instantiate(fmi3String name, fmi3String token, fmi2Type kind, fmi3Boolean log,
                                fmi3InstanceEnvironment environment, fmi3LogMessageCallback message) {
    Fmi3Instance *made = calloc(1, sizeof *made);
    fmi2CallbackFunctions callbacks = {forward_message, NULL, NULL, NULL, NULL};
    if (!made) return NULL;
    made->environment = environment;
    made->log = message;
    callbacks.componentEnvironment = made;
    made->core = FMI2_NAME(fmi2Instantiate)(name, kind, token, NULL, &callbacks, fmi2False, log);
    if (made->core) return made;
    free(made);
    return NULL;
}

FMI3_EXPORT const char *FMI3_NAME(fmi3GetVersion)(void) { return "3.0"; }

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateModelExchange)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean log,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback message) {
    (void)resources, (void)visible; /* the binary contains all data */
    return instantiate(name, token, fmi2ModelExchange, log, environment, message);
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean log,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback message, fmi3IntermediateUpdateCallback update) {
    (void)resources, (void)visible, (void)early, (void)required, (void)update;
    if (events || count) {
        if (log && message)
            message(environment, fmi3Error, "logStatusError", events ?
                    "fmi3InstantiateCoSimulation: expected eventModeUsed = false: the FMU has no event mode" :
                    "fmi3InstantiateCoSimulation: expected no required intermediate variables: there are none");
        return NULL;
    }
    return instantiate(name, token, fmi2CoSimulation, log, environment, message);
}

FMI3_EXPORT fmi3Instance FMI3_NAME(fmi3InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean log,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback message, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)update, (void)lock, (void)unlock;
    if (log && message)
        message(environment, fmi3Error, "logStatusError",
                "fmi3InstantiateScheduledExecution: the FMU is for co-simulation and model exchange");
    return NULL;
}

FMI3_EXPORT void FMI3_NAME(fmi3FreeInstance)(fmi3Instance instance) {
    if (!instance) return;
    FMI2_NAME(fmi2FreeInstance)(CORE(instance));
    free(instance);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetDebugLogging)(fmi3Instance instance, fmi3Boolean on, size_t count,
                                                      const fmi3String categories[]) {
    return (fmi3Status)FMI2_NAME(fmi2SetDebugLogging)(CORE(instance), on, count, categories);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3EnterInitializationMode)(fmi3Instance instance, fmi3Boolean has_tolerance,
                                                              fmi3Float64 tolerance, fmi3Float64 start,
                                                              fmi3Boolean has_stop, fmi3Float64 stop) {
    fmi2Status status =
        FMI2_NAME(fmi2SetupExperiment)(CORE(instance), has_tolerance, tolerance, start, has_stop, stop);
    return (fmi3Status)(status == fmi2OK ? FMI2_NAME(fmi2EnterInitializationMode)(CORE(instance)) : status);
}

#define FORWARD_CALL(name)                                                \
    FMI3_EXPORT fmi3Status FMI3_NAME(fmi3##name)(fmi3Instance instance) { \
        return (fmi3Status)FMI2_NAME(fmi2##name)(CORE(instance));         \
    }
FORWARD_CALL(ExitInitializationMode)
FORWARD_CALL(EnterEventMode)
FORWARD_CALL(EnterContinuousTimeMode)
FORWARD_CALL(Terminate)
FORWARD_CALL(Reset)
