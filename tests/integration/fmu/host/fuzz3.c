/* Calls of FMI 3.0 in any order with any values; no call may crash or be fatal, and a reset restores the start.

   fuzz3 LIBRARY TOKEN N SEED */

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3_api.h"

static void *library;
static const char *token;
static unsigned long long state;

static void *find(const char *name) {
    void *found = dlsym(library, name);
    if (!found) exit(2);
    return found;
}

static unsigned below(unsigned n) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(state >> 33) % n;
}

static double any(void) {
    static const double odd[] = {0.0, -0.0, 1.0, -1.0, 1e-310, 1e300, NAN, INFINITY, -INFINITY, 20.0, -300.0, 0.5};
    return below(3) ? ((double)below(2000) - 1000.0) * 1e-6 : odd[below(sizeof odd / sizeof *odd)];
}

static void say(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String message) {
    if (e != &state || s == fmi3OK || !category || strlen(message) > 600 || strstr(message, "fmi2")) exit(3);
}

typedef fmi3Status Plain(fmi3Instance);
typedef fmi3Status Get(fmi3Instance, const fmi3ValueReference *, size_t, double *, size_t);
typedef fmi3Status Set(fmi3Instance, const fmi3ValueReference *, size_t, const double *, size_t);
typedef fmi3Status Begin(fmi3Instance, bool, double, double, bool, double);
typedef fmi3Status Step(fmi3Instance, double, double, bool, bool *, bool *, bool *, double *);
#define CALL(name, type, ...) ((__typeof__(type) *)find(name))(__VA_ARGS__)

static fmi3Instance make(int exchange, int events) {
    if (exchange)
        return CALL("fmi3InstantiateModelExchange", fmi3Instance(fmi3String, fmi3String, fmi3String, bool, bool,
            fmi3InstanceEnvironment, fmi3LogMessageCallback), "x", token, NULL, false, true, &state, say);
    return CALL("fmi3InstantiateCoSimulation", fmi3Instance(fmi3String, fmi3String, fmi3String, bool, bool, bool, bool,
        const fmi3ValueReference *, size_t, fmi3InstanceEnvironment, fmi3LogMessageCallback,
        fmi3IntermediateUpdateCallback), "x", token, NULL, false, true, events, false, NULL, 0, &state, say, NULL);
}

static double after_reset(fmi3Instance c) {
    static const fmi3ValueReference some[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    double values[8], reached, sum = 0.0;
    bool flags[3];
    if (CALL("fmi3Reset", Plain, c) || CALL("fmi3EnterInitializationMode", Begin, c, false, 0.0, 0.0, false, 0.0) ||
        CALL("fmi3ExitInitializationMode", Plain, c))
        exit(4);
    for (int k = 0; k < 20; k++) {
        if (CALL("fmi3DoStep", Step, c, 1e-3 * k, 1e-3, true, &flags[0], &flags[1], &flags[2], &reached) ||
            CALL("fmi3GetFloat64", Get, c, some, 8, values, 8))
            exit(5);
        for (int i = 0; i < 8; i++) sum += values[i] * (i + k + 1);
    }
    return sum;
}

int main(int count, char **words) {
    enum { N = 3, M = 128 };
    fmi3Instance c[N] = {0};
    int exchange[N] = {0};
    fmi3FMUState saved[N] = {0};
    fmi3ValueReference references[M];
    double values[M] = {0}, more[M] = {0}, fresh;
    fmi3Byte bytes[1 << 14];
    size_t size = 0;
    long fine = 0, calls;
    typedef fmi3Status Free(fmi3Instance, fmi3FMUState *);
    if (count != 5 || !(library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL))) return 1;
    token = words[2], calls = atol(words[3]), state = (unsigned long long)atol(words[4]);
    for (long k = 0; k < calls; k++) {
        unsigned i = below(N), n = below(6);
        fmi3Status answer = fmi3OK;
        bool flags[5];
        size_t length = below(10) ? n : below(9);
        if (!c[i]) {
            exchange[i] = (int)below(2);
            c[i] = make(exchange[i], !below(10));
            continue;
        }
        for (unsigned j = 0; j < n; j++) {
            references[j] = below(10) ? below(90) : below(1u << 30);
            values[j] = any();
        }
        switch (below(24)) {
        case 0: answer = CALL("fmi3EnterInitializationMode", Begin, c[i], true, any(), any(), below(2), any()); break;
        case 1: answer = CALL("fmi3EnterInitializationMode", Begin, c[i], false, 0.0, 0.0, false, 0.0); break;
        case 2: case 3: answer = CALL("fmi3ExitInitializationMode", Plain, c[i]); break;
        case 4: if (!below(20)) answer = CALL("fmi3Terminate", Plain, c[i]); break;
        case 5: if (!below(5)) answer = CALL("fmi3Reset", Plain, c[i]); break;
        case 6: case 7: answer = CALL("fmi3SetFloat64", Set, c[i], references, n, values, length); break;
        case 8: for (unsigned j = 0; j < n; j++) references[j] = j + 1;
            answer = CALL("fmi3SetFloat64", Set, c[i], references, n, values, n); break;
        case 9: case 10: answer = CALL("fmi3GetFloat64", Get, c[i], references, n, more, length); break;
        case 11: answer = CALL("fmi3GetFloat64", Get, below(9) ? c[i] : NULL, NULL, n, more, n); break;
        case 12: case 13: answer = CALL("fmi3DoStep", Step, c[i], any(), any(), true, &flags[0], &flags[1], &flags[2],
                                        more); break;
        case 14: answer = CALL("fmi3GetDirectionalDerivative", fmi3Status(fmi3Instance, const fmi3ValueReference *,
                     size_t, const fmi3ValueReference *, size_t, const double *, size_t, double *, size_t), c[i],
                     references, n / 2, references + n / 2, n - n / 2, values, below(9) ? n - n / 2 : n, more, n / 2);
            break;
        case 15: answer = CALL("fmi3GetFMUState", Free, c[i], &saved[i]); break;
        case 16: answer = CALL("fmi3SetFMUState", fmi3Status(fmi3Instance, fmi3FMUState), c[i], saved[below(N)]); break;
        case 17: answer = CALL("fmi3FreeFMUState", Free, c[i], &saved[i]); break;
        case 18:
            answer = CALL("fmi3SerializedFMUStateSize", fmi3Status(fmi3Instance, fmi3FMUState, size_t *), c[i],
                          saved[i], &size);
            if (answer == fmi3OK && size <= sizeof bytes)
                CALL("fmi3SerializeFMUState", fmi3Status(fmi3Instance, fmi3FMUState, fmi3Byte *, size_t), c[i],
                     saved[i], bytes, size);
            break;
        case 19:
            if (size && size <= sizeof bytes) {
                if (below(2)) bytes[below((unsigned)size)] ^= (fmi3Byte)(1 << below(8));
                answer = CALL("fmi3DeserializeFMUState", fmi3Status(fmi3Instance, const fmi3Byte *, size_t,
                              fmi3FMUState *), c[i], bytes, below(4) ? size : below(1000), &saved[i]);
            }
            break;
        case 20: answer = CALL(below(2) ? "fmi3EnterContinuousTimeMode" : "fmi3EnterEventMode", Plain, c[i]); break;
        case 21: {
            static const char *vectors[] = {"fmi3GetContinuousStateDerivatives", "fmi3GetContinuousStates",
                                            "fmi3GetEventIndicators", "fmi3GetNominalsOfContinuousStates",
                                            "fmi3SetContinuousStates"};
            answer = CALL(vectors[below(5)], fmi3Status(fmi3Instance, double *, size_t), c[i], more,
                          below(2) ? 10 : below(20));
            break;
        }
        case 22: answer = CALL("fmi3UpdateDiscreteStates", fmi3Status(fmi3Instance, bool *, bool *, bool *, bool *,
                     bool *, double *), c[i], &flags[0], &flags[1], &flags[2], &flags[3], &flags[4], more);
            CALL("fmi3CompletedIntegratorStep", fmi3Status(fmi3Instance, bool, bool *, bool *), c[i], true, &flags[0],
                 &flags[1]);
            CALL("fmi3SetTime", fmi3Status(fmi3Instance, double), c[i], any());
            break;
        default: {
            static const char *absent[] = {"fmi3EnterStepMode", "fmi3EnterConfigurationMode",
                                           "fmi3EvaluateDiscreteStates"};
            if (CALL(absent[below(3)], Plain, below(5) ? c[i] : NULL) != fmi3Error) return 6;
            if (!below(50)) {
                for (unsigned j = 0; j < N; j++) CALL("fmi3FreeFMUState", Free, c[i], &saved[j]);
                CALL("fmi3FreeInstance", void(fmi3Instance), c[i]);
                c[i] = NULL;
            }
        }
        }
        if (answer == fmi3Fatal) return 7;
        fine += answer == fmi3OK;
    }
    {
        fmi3Instance another = make(0, 0);
        fresh = after_reset(another);
        CALL("fmi3FreeInstance", void(fmi3Instance), another);
    }
    for (unsigned i = 0; i < N; i++) {
        if (!c[i]) continue;
        if (!exchange[i] && after_reset(c[i]) != fresh) return 8;
        for (unsigned j = 0; j < N; j++) CALL("fmi3FreeFMUState", Free, c[i], &saved[j]);
        CALL("fmi3FreeInstance", void(fmi3Instance), c[i]);
    }
    printf("%ld\n", fine);
    return fine > calls / 5 ? 0 : 9;
}
