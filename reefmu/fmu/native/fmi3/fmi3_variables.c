/* Variables, saved states and derivatives (FMI 3.0.2, sections 2.2.6, 2.2.9, 2.2.11). All variables are scalar Float64.
   The value reference of time, the independent variable, follows those of the variables and the event indicators. */

enum { TIME = FIRST_REFERENCE + N_VALUES + N_INDICATORS };

static int counts_match(fmi3Instance instance, size_t references, size_t values) {
    if (references == values) return 1;
    log_error(instance, "expected one value for each value reference, because all variables are scalar");
    return 0;
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetFloat64)(fmi3Instance instance, const fmi3ValueReference references[],
                                                 size_t count, fmi3Float64 values[], size_t n_values) {
    size_t first = 0; /* of a sequence of references other than time */
    fmi2Status worst = fmi2OK;
    if (!instance || !counts_match(instance, count, n_values)) return fmi3Error;
    for (size_t k = 0; references && values && k <= count; k++) {
        if (k < count && references[k] != TIME) continue;
        if (k > first) {
            fmi2Status status = FMI2_NAME(fmi2GetReal)(CORE(instance), references + first, k - first, values + first);
            if (status > worst) worst = status;
            if (status >= fmi2Error) break;
        }
        if (k < count) values[k] = ((const Instance *)CORE(instance))->now.time;
        first = k + 1;
    }
    if (references && values) return (fmi3Status)worst;
    return (fmi3Status)FMI2_NAME(fmi2GetReal)(CORE(instance), references, count, values);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetFloat64)(fmi3Instance instance, const fmi3ValueReference references[],
                                                 size_t count, const fmi3Float64 values[], size_t n_values) {
    if (!instance || !counts_match(instance, count, n_values)) return fmi3Error;
    return (fmi3Status)FMI2_NAME(fmi2SetReal)(CORE(instance), references, count, values);
}

/* No variable has these types: an empty list is accepted, anything else is an error. */
#define NO_FMI3_VARIABLES(type)                                                                                   \
    FMI3_EXPORT fmi3Status FMI3_NAME(fmi3Get##type)(fmi3Instance instance, const fmi3ValueReference references[], \
                                                    size_t count, fmi3##type values[], size_t n_values) {         \
        (void)references, (void)values, (void)n_values;                                                           \
        return reject_type(instance, count);                                                                      \
    }                                                                                                             \
    FMI3_EXPORT fmi3Status FMI3_NAME(fmi3Set##type)(fmi3Instance instance, const fmi3ValueReference references[], \
                                                    size_t count, const fmi3##type values[], size_t n_values) {   \
        (void)references, (void)values, (void)n_values;                                                           \
        return reject_type(instance, count);                                                                      \
    }

static fmi3Status reject_type(fmi3Instance instance, size_t count) {
    if (instance && !count) return fmi3OK;
    log_error(instance, "this FMU has Float64 variables only");
    return fmi3Error;
}

NO_FMI3_VARIABLES(Float32)
NO_FMI3_VARIABLES(Int8)
NO_FMI3_VARIABLES(UInt8)
NO_FMI3_VARIABLES(Int16)
NO_FMI3_VARIABLES(UInt16)
NO_FMI3_VARIABLES(Int32)
NO_FMI3_VARIABLES(UInt32)
NO_FMI3_VARIABLES(Int64)
NO_FMI3_VARIABLES(UInt64)
NO_FMI3_VARIABLES(Boolean)
NO_FMI3_VARIABLES(String)

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetBinary)(fmi3Instance instance, const fmi3ValueReference references[],
                                                size_t count, size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)references, (void)sizes, (void)values, (void)n_values;
    return reject_type(instance, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetBinary)(fmi3Instance instance, const fmi3ValueReference references[],
                                                size_t count, const size_t sizes[], const fmi3Binary values[],
                                                size_t n_values) {
    (void)references, (void)sizes, (void)values, (void)n_values;
    return reject_type(instance, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetClock)(fmi3Instance instance, const fmi3ValueReference references[],
                                               size_t count, fmi3Clock values[]) {
    (void)references, (void)values;
    return reject_type(instance, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetClock)(fmi3Instance instance, const fmi3ValueReference references[],
                                               size_t count, const fmi3Clock values[]) {
    (void)references, (void)values;
    return reject_type(instance, count);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetFMUState)(fmi3Instance instance, fmi3FMUState *state) {
    return (fmi3Status)FMI2_NAME(fmi2GetFMUstate)(CORE(instance), state);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SetFMUState)(fmi3Instance instance, fmi3FMUState state) {
    return (fmi3Status)FMI2_NAME(fmi2SetFMUstate)(CORE(instance), state);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3FreeFMUState)(fmi3Instance instance, fmi3FMUState *state) {
    return (fmi3Status)FMI2_NAME(fmi2FreeFMUstate)(CORE(instance), state);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SerializedFMUStateSize)(fmi3Instance instance, fmi3FMUState state, size_t *size) {
    return (fmi3Status)FMI2_NAME(fmi2SerializedFMUstateSize)(CORE(instance), state, size);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3SerializeFMUState)(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                                        size_t size) {
    return (fmi3Status)FMI2_NAME(fmi2SerializeFMUstate)(CORE(instance), state, (fmi2Byte *)bytes, size);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3DeserializeFMUState)(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                                          fmi3FMUState *state) {
    return (fmi3Status)FMI2_NAME(fmi2DeSerializeFMUstate)(CORE(instance), (const fmi2Byte *)bytes, size, state);
}

FMI3_EXPORT fmi3Status FMI3_NAME(fmi3GetDirectionalDerivative)(
    fmi3Instance instance, const fmi3ValueReference unknowns[], size_t n_unknowns, const fmi3ValueReference knowns[],
    size_t n_knowns, const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    if (!instance || !counts_match(instance, n_unknowns, n_sensitivity) || !counts_match(instance, n_knowns, n_seed))
        return fmi3Error;
    return (fmi3Status)FMI2_NAME(fmi2GetDirectionalDerivative)(CORE(instance), unknowns, n_unknowns, knowns, n_knowns,
                                                               seed, sensitivity);
}
