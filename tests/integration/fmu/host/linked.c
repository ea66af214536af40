/* A host with statically linked FMUs, compiled from their sources. linked.h lists them as

   X(PREFIX, TOKEN, INPUT, VALUE, OUTPUT)   value references of an input and an output, and the input's value

   Each makes one step of 1 ms, and its output is printed on a line. Then each receives a log category that looks like a
   format string of printf, and the message about it is printed as the standard requires of a host. */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#if FMI == 2
#include "fmi2_api.h"
#else
#include "fmi3_api.h"
#endif

static const char *const category[] = {"%n%s#"};

#if FMI == 2

static void say(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String sort, fmi2String message, ...) {
    char text[700];
    va_list values;
    (void)e, (void)name, (void)status, (void)sort;
    va_start(values, message);
    vsnprintf(text, sizeof text, message, values);
    va_end(values);
    puts(text);
}

static const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};

#define X(prefix, token, input, value, output)                                                                  \
    fmi2Component prefix##fmi2Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String,                         \
                                          const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);             \
    fmi2Status prefix##fmi2EnterInitializationMode(fmi2Component);                                              \
    fmi2Status prefix##fmi2ExitInitializationMode(fmi2Component);                                               \
    fmi2Status prefix##fmi2SetReal(fmi2Component, const unsigned *, size_t, const double *);                    \
    fmi2Status prefix##fmi2GetReal(fmi2Component, const unsigned *, size_t, double *);                          \
    fmi2Status prefix##fmi2DoStep(fmi2Component, double, double, fmi2Boolean);                                  \
    fmi2Status prefix##fmi2SetDebugLogging(fmi2Component, fmi2Boolean, size_t, const fmi2String[]);             \
    void prefix##fmi2FreeInstance(fmi2Component);                                                               \
    static int prefix##run(void) {                                                                              \
        const unsigned in = input, out = output;                                                                \
        double u = value, y = 0.0;                                                                              \
        fmi2Component c = prefix##fmi2Instantiate("x", fmi2CoSimulation, token, NULL, &callbacks, 0, 1);        \
        if (!c || prefix##fmi2EnterInitializationMode(c) || prefix##fmi2ExitInitializationMode(c) ||            \
            prefix##fmi2SetReal(c, &in, 1, &u) || prefix##fmi2DoStep(c, 0.0, 1e-3, 1) ||                        \
            prefix##fmi2GetReal(c, &out, 1, &y))                                                                \
            return 1;                                                                                           \
        printf("%.17g\n", y);                                                                                   \
        if (prefix##fmi2SetDebugLogging(c, 1, 1, category) != fmi2Error) return 1;                              \
        prefix##fmi2FreeInstance(c);                                                                            \
        return 0;                                                                                               \
    }
#else

static void say(fmi3InstanceEnvironment e, fmi3Status status, fmi3String sort, fmi3String message) {
    (void)e, (void)status, (void)sort;
    puts(message);
}

#define X(prefix, token, input, value, output)                                                                  \
    fmi3Instance prefix##fmi3InstantiateCoSimulation(                                                           \
        fmi3String, fmi3String, fmi3String, bool, bool, bool, bool, const fmi3ValueReference *, size_t,         \
        fmi3InstanceEnvironment, fmi3LogMessageCallback, fmi3IntermediateUpdateCallback);                       \
    fmi3Status prefix##fmi3EnterInitializationMode(fmi3Instance, bool, double, double, bool, double);           \
    fmi3Status prefix##fmi3ExitInitializationMode(fmi3Instance);                                                \
    fmi3Status prefix##fmi3SetFloat64(fmi3Instance, const fmi3ValueReference *, size_t, const double *, size_t);\
    fmi3Status prefix##fmi3GetFloat64(fmi3Instance, const fmi3ValueReference *, size_t, double *, size_t);      \
    fmi3Status prefix##fmi3DoStep(fmi3Instance, double, double, bool, bool *, bool *, bool *, double *);        \
    fmi3Status prefix##fmi3SetDebugLogging(fmi3Instance, bool, size_t, const fmi3String[]);                     \
    void prefix##fmi3FreeInstance(fmi3Instance);                                                                \
    static int prefix##run(void) {                                                                              \
        const unsigned in = input, out = output;                                                                \
        double u = value, y = 0.0, reached;                                                                     \
        bool flags[3];                                                                                          \
        fmi3Instance c = prefix##fmi3InstantiateCoSimulation("x", token, NULL, false, true, false, false, NULL, \
                                                             0, NULL, say, NULL);                               \
        if (!c || prefix##fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0) ||                        \
            prefix##fmi3ExitInitializationMode(c) || prefix##fmi3SetFloat64(c, &in, 1, &u, 1) ||                \
            prefix##fmi3DoStep(c, 0.0, 1e-3, true, &flags[0], &flags[1], &flags[2], &reached) ||                \
            prefix##fmi3GetFloat64(c, &out, 1, &y, 1))                                                          \
            return 1;                                                                                           \
        printf("%.17g\n", y);                                                                                   \
        if (prefix##fmi3SetDebugLogging(c, true, 1, category) != fmi3Error) return 1;                           \
        prefix##fmi3FreeInstance(c);                                                                            \
        return 0;                                                                                               \
    }
#endif
#include "linked.h"
#undef X

int main(void) {
#define X(prefix, token, input, value, output) if (prefix##run()) return 1;
#include "linked.h"
    return 0;
}
