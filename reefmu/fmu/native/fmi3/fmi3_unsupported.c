/* Functions without support, as the model description declares: clocks, structural parameters, adjoint derivatives,
   output derivatives, event mode in co-simulation. The standard requires the functions to exist; every call is
   refused. */

#define UNSUPPORTED(name, ...)                                                     \
    FMI3_EXPORT fmi3Status FMI3_NAME(name)(fmi3Instance instance, ##__VA_ARGS__) { \
        log_error(instance, #name ": not supported by this FMU");                  \
        return fmi3Error;                                                          \
    }

UNSUPPORTED(fmi3EnterConfigurationMode)
UNSUPPORTED(fmi3ExitConfigurationMode)
UNSUPPORTED(fmi3EnterStepMode)
UNSUPPORTED(fmi3EvaluateDiscreteStates)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *count)
UNSUPPORTED(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
            fmi3ValueReference independents[], size_t indices[], fmi3DependencyKind kinds[], size_t count)
UNSUPPORTED(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t n_unknowns,
            const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
            fmi3Float64 sensitivity[], size_t n_sensitivity)
UNSUPPORTED(fmi3GetOutputDerivatives, const fmi3ValueReference references[], size_t count, const fmi3Int32 orders[],
            fmi3Float64 values[], size_t n_values)
UNSUPPORTED(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
UNSUPPORTED(fmi3GetIntervalDecimal, const fmi3ValueReference references[], size_t count, fmi3Float64 intervals[],
            fmi3IntervalQualifier qualifiers[])
UNSUPPORTED(fmi3GetIntervalFraction, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
            fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
UNSUPPORTED(fmi3GetShiftDecimal, const fmi3ValueReference references[], size_t count, fmi3Float64 shifts[])
UNSUPPORTED(fmi3GetShiftFraction, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
            fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3SetIntervalDecimal, const fmi3ValueReference references[], size_t count, const fmi3Float64 intervals[])
UNSUPPORTED(fmi3SetIntervalFraction, const fmi3ValueReference references[], size_t count, const fmi3UInt64 counters[],
            const fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3SetShiftDecimal, const fmi3ValueReference references[], size_t count, const fmi3Float64 shifts[])
UNSUPPORTED(fmi3SetShiftFraction, const fmi3ValueReference references[], size_t count, const fmi3UInt64 counters[],
            const fmi3UInt64 resolutions[])
