/* Instances, from instantiation to termination (FMI 2.0.4, sections 2.1.5 and 2.1.6). */

static const char *text_or_placeholder(const char *text) { return text ? text : "(none)"; }

static void set_start_values(Instance *instance, fmi2Type kind) {
    memset(&instance->now, 0, sizeof instance->now);
    instance->coefficients_known = 0;
    instance->now.kind = (int)kind;
    instance->now.phase = INSTANTIATED;
    instance->now.stale = STALE_ALL;
    for (size_t k = 0; k < N_VALUES; k++) instance->now.values[k] = VARIABLES[k].start;
}

FMI2_EXPORT const char *FMI2_NAME(fmi2GetTypesPlatform)(void) { return "default"; }

FMI2_EXPORT const char *FMI2_NAME(fmi2GetVersion)(void) { return "2.0"; }

FMI2_EXPORT fmi2Component FMI2_NAME(fmi2Instantiate)(fmi2String name, fmi2Type kind, fmi2String guid,
                                                     fmi2String resources, const fmi2CallbackFunctions *callbacks,
                                                     fmi2Boolean visible, fmi2Boolean log) {
    HostLog host_log;
    Instance *instance;
    size_t length;
    const char *problem = NULL;
    (void)resources; /* the binary contains all data */
    (void)visible;
    if (!callbacks) return NULL;
    host_log.callbacks = *callbacks;
    host_log.name = text_or_placeholder(name);
    host_log.categories = log ? LOG_ALL : LOG_OFF;
    if (!name || !*name) problem = "expected a name of the instance, got none";
    else if (kind != fmi2CoSimulation && kind != fmi2ModelExchange) problem = "unknown type of FMU";
    if (problem || !guid || strcmp(guid, MODEL_GUID) != 0) {
        if (problem) log_message(&host_log, fmi2Error, IN_FMI("Instantiate", "Instantiate") ": %s", problem);
        else
            log_message(&host_log, fmi2Error, IN_FMI("Instantiate", "Instantiate") ": expected GUID %s, got %.60s",
                        MODEL_GUID, text_or_placeholder(guid));
        return NULL;
    }
    length = strlen(name) + 1;
    instance = callbacks->allocateMemory ? callbacks->allocateMemory(1, sizeof *instance + length)
                                         : calloc(1, sizeof *instance + length);
    if (!instance) {
        log_message(&host_log, fmi2Error, IN_FMI("Instantiate", "Instantiate") ": out of memory");
        return NULL;
    }
    host_log.name = memcpy((char *)(instance + 1), name, length);
    instance->log = host_log;
    set_start_values(instance, kind);
    return instance;
}

FMI2_EXPORT void FMI2_NAME(fmi2FreeInstance)(fmi2Component component) {
    Instance *instance = component;
    if (!instance) return;
    if (!instance->log.callbacks.allocateMemory) free(instance);
    else if (instance->log.callbacks.freeMemory) instance->log.callbacks.freeMemory(instance);
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetupExperiment)(fmi2Component component, fmi2Boolean has_tolerance,
                                                      fmi2Real tolerance, fmi2Real start, fmi2Boolean has_stop,
                                                      fmi2Real stop) {
    Instance *instance = component;
    (void)has_tolerance;
    (void)tolerance;
    if (!allowed(instance, &CALL_SetupExperiment)) return fmi2Error;
    if (!all_finite(&start, 1) || (has_stop && !(stop >= start && stop < HUGE_VAL))) {
        report(instance, fmi2Error, "%s: expected a finite start time and a stop time not before it, got %g s and %g s",
               CALL_SetupExperiment.name, start, stop);
        return fmi2Error;
    }
    instance->now.time = instance->now.start = start;
    instance->now.stops = has_stop != 0;
    instance->now.stop = has_stop ? stop : start;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2EnterInitializationMode)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_EnterInitializationMode)) return fmi2Error;
    instance->now.phase = INITIALISING;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2ExitInitializationMode)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_ExitInitializationMode)) return fmi2Error;
    if (!refresh(instance, STALE_OUTPUTS)) {
        report(instance, fmi2Error, "%s: %s", CALL_ExitInitializationMode.name, no_result(instance));
        return fmi2Error;
    }
    accumulate_path(instance);
    memset(instance->now.path_from_speeds, 0, sizeof instance->now.path_from_speeds);
    instance->now.phase = instance->now.kind == fmi2CoSimulation ? STEPPING : EVENT_MODE;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2Terminate)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_Terminate)) return fmi2Error;
    instance->now.phase = TERMINATED;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2Reset)(fmi2Component component) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_Reset)) return fmi2Error;
    set_start_values(instance, (fmi2Type)instance->now.kind);
    return fmi2OK;
}
