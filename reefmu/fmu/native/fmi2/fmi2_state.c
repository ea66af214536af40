/* Saved states (FMI 2.0.4, section 2.1.8). Serialised bytes are valid for the same FMU on the same platform. */

typedef struct {
    char guid[sizeof MODEL_GUID];
    InstanceState content;
} Saved;

static Saved *new_saved(const Instance *instance) {
    return instance->log.callbacks.allocateMemory ? instance->log.callbacks.allocateMemory(1, sizeof(Saved))
                                                  : calloc(1, sizeof(Saved));
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2GetFMUstate)(fmi2Component component, fmi2FMUstate *state) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_FMUstate) || !has_array(instance, &CALL_FMUstate, state, 1)) return fmi2Error;
    if (!*state) *state = new_saved(instance);
    if (!*state) {
        report(instance, fmi2Error, IN_FMI("GetFMUstate", "GetFMUState") ": out of memory");
        return fmi2Error;
    }
    memcpy(((Saved *)*state)->guid, MODEL_GUID, sizeof MODEL_GUID);
    ((Saved *)*state)->content = instance->now;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SetFMUstate)(fmi2Component component, fmi2FMUstate state) {
    Instance *instance = component;
    const Saved *saved = state;
    if (!allowed(instance, &CALL_FMUstate) || !has_array(instance, &CALL_FMUstate, state, 1)) return fmi2Error;
    if (saved->content.kind != instance->now.kind) {
        report(instance, fmi2Error, IN_FMI("SetFMUstate", "SetFMUState")
               ": expected a state of the same interface type");
        return fmi2Error;
    }
    instance->now = saved->content;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2FreeFMUstate)(fmi2Component component, fmi2FMUstate *state) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_FMUstate)) return fmi2Error;
    if (!state || !*state) return fmi2OK;
    if (!instance->log.callbacks.allocateMemory) free(*state);
    else if (instance->log.callbacks.freeMemory) instance->log.callbacks.freeMemory(*state);
    *state = NULL;
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SerializedFMUstateSize)(fmi2Component component, fmi2FMUstate state,
                                                             size_t *size) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_FMUstate) || !has_array(instance, &CALL_FMUstate, state, 1) ||
        !has_array(instance, &CALL_FMUstate, size, 1))
        return fmi2Error;
    *size = sizeof(Saved);
    return fmi2OK;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2SerializeFMUstate)(fmi2Component component, fmi2FMUstate state, fmi2Byte bytes[],
                                                        size_t size) {
    Instance *instance = component;
    if (!allowed(instance, &CALL_FMUstate) || !has_array(instance, &CALL_FMUstate, state, 1) ||
        !has_array(instance, &CALL_FMUstate, bytes, 1))
        return fmi2Error;
    if (size < sizeof(Saved)) {
        report(instance, fmi2Error, IN_FMI("SerializeFMUstate", "SerializeFMUState")
               ": expected room for %lu bytes, got %lu",
               (unsigned long)sizeof(Saved), (unsigned long)size);
        return fmi2Error;
    }
    memcpy(bytes, state, sizeof(Saved));
    return fmi2OK;
}

/* Whether bytes from the host are a possible state of this FMU. */
static int is_valid(const Saved *saved) {
    const InstanceState *content = &saved->content;
    int cosimulation = content->kind == fmi2CoSimulation, phase = content->phase;
    if (memcmp(saved->guid, MODEL_GUID, sizeof MODEL_GUID) != 0) return 0;
    if (!cosimulation && content->kind != fmi2ModelExchange) return 0;
    if (phase != INSTANTIATED && phase != INITIALISING && phase != TERMINATED &&
        !(cosimulation ? phase == STEPPING : phase == EVENT_MODE || phase == CONTINUOUS_MODE))
        return 0;
    if (content->stale & ~STALE_ALL || content->status < fmi2OK || content->status > fmi2Discard) return 0;
    if (content->stops & ~1 || !all_finite(&content->start, 1) || !all_finite(&content->stop, 1)) return 0;
    if (!all_finite(&content->next_discrete, 1) || !all_finite(content->last_path_values, N_INDICATORS + 1) ||
        !all_finite(content->path_from_speeds, N_INDICATORS + 1))
        return 0;
    if (!all_finite(&content->time, 1) || !all_finite(content->values, N_VALUES)) return 0;
    if (content->contact.known & ~1 || !all_finite(content->contact.point, N_CONTACT_POINT) ||
        !all_finite(&content->contact.twist, 1) || !all_finite(content->contact.outputs, N_CONTACT))
        return 0;
    for (size_t k = 0; k < N_VALUES; k++)
        if (VARIABLES[k].access != RESULT &&
            !(content->values[k] >= VARIABLES[k].low && content->values[k] <= VARIABLES[k].high))
            return 0;
    return 1;
}

FMI2_EXPORT fmi2Status FMI2_NAME(fmi2DeSerializeFMUstate)(fmi2Component component, const fmi2Byte bytes[], size_t size,
                                                          fmi2FMUstate *state) {
    Instance *instance = component;
    Saved came;
    if (!allowed(instance, &CALL_FMUstate) || !has_array(instance, &CALL_FMUstate, bytes, 1) ||
        !has_array(instance, &CALL_FMUstate, state, 1))
        return fmi2Error;
    if (size == sizeof came) memcpy(&came, bytes, sizeof came);
    if (size != sizeof came || !is_valid(&came)) {
        report(instance, fmi2Error, IN_FMI("DeSerializeFMUstate", "DeserializeFMUState")
               ": expected a state of this FMU, got %lu other bytes",
               (unsigned long)size);
        return fmi2Error;
    }
    if (!*state) *state = new_saved(instance);
    if (!*state) {
        report(instance, fmi2Error, IN_FMI("DeSerializeFMUstate", "DeserializeFMUState") ": out of memory");
        return fmi2Error;
    }
    memcpy(*state, &came, sizeof came);
    return fmi2OK;
}
