/* A host for tests: loads the library of an FMU and runs one of several tests. Exit status 0: passed.

   host LIBRARY GUID loop N PAGES load, instantiate, step, free, unload, N times; memory may grow by PAGES pages
   host LIBRARY GUID fuzz N SEED  N random calls with random values
   host LIBRARY GUID threads N    two threads with five instances each, N steps; all must agree
   host LIBRARY GUID time N       shortest time of set + step + get, us */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2_api.h"

static void *library;
static const char *guid;

static void *function(const char *name) {
    void *found = dlsym(library, name);
    if (!found) {
        fprintf(stderr, "no %s\n", name);
        exit(2);
    }
    return found;
}

static void quiet(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c;
    if (strlen(m) > 600) exit(3);
}

static const fmi2CallbackFunctions callbacks = {quiet, calloc, free, NULL, NULL};

typedef fmi2Component Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, int, int);
typedef fmi2Status Plain(fmi2Component);
typedef fmi2Status Get(fmi2Component, const unsigned *, size_t, double *);
typedef fmi2Status Set(fmi2Component, const unsigned *, size_t, const double *);
typedef fmi2Status Step(fmi2Component, double, double, int);

static fmi2Component start(fmi2Type kind) {
    fmi2Component made = ((Instantiate *)function("fmi2Instantiate"))("x", kind, guid, "", &callbacks, 0, 1);
    if (!made) exit(4);
    ((Plain *)function("fmi2EnterInitializationMode"))(made);
    if (((Plain *)function("fmi2ExitInitializationMode"))(made) != fmi2OK) exit(5);
    return made;
}

static const unsigned inputs[5] = {0, 1, 2, 3, 4}, output = 5;

static void angles(long k, double *u) {
    u[0] = 0.2 + 1e-4 * (double)(k % 5000);
    u[1] = 0.1;
    u[2] = u[0] / -29.0 - 1e-3 * sin(0.01 * (double)k);
    u[3] = 0.0;
    u[4] = 20.0;
}

static double run(fmi2Component c, long steps) {
    Set *set = (Set *)function("fmi2SetReal");
    Step *step = (Step *)function("fmi2DoStep");
    Get *get = (Get *)function("fmi2GetReal");
    double u[5], y, sum = 0.0;
    for (long k = 0; k < steps; k++) {
        angles(k, u);
        if (set(c, inputs, 5, u) || step(c, 1e-3 * (double)k, 1e-3, 1) || get(c, &output, 1, &y)) exit(6);
        sum += y * (double)(k % 7 + 1);
    }
    return sum;
}

static long resident(void) {
    long pages = 0, total;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file && fscanf(file, "%ld %ld", &total, &pages) != 2) pages = 0;
    if (file) fclose(file);
    return pages;
}

static int loop(const char *path, long count, long most) {
    long before = 0;
    for (long k = 0; k < count; k++) {
        if (k == count / 2) before = resident();
        library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (!library) return 7;
        fmi2Component c = start(fmi2CoSimulation);
        run(c, 2);
        ((void (*)(fmi2Component))function("fmi2FreeInstance"))(c);
        dlclose(library);
    }
    printf("%ld\n", resident() - before);
    return resident() - before > most ? 8 : 0;
}

static void *worker(void *result) {
    fmi2Component c[5];
    double sums[5] = {0};
    for (int i = 0; i < 5; i++) c[i] = start(fmi2CoSimulation);
    for (int i = 0; i < 5; i++) sums[i] = run(c[i], *(double *)result);
    for (int i = 1; i < 5; i++)
        if (sums[i] != sums[0]) exit(9);
    for (int i = 0; i < 5; i++) ((void (*)(fmi2Component))function("fmi2FreeInstance"))(c[i]);
    *(double *)result = sums[0];
    return NULL;
}

static int threads(long steps) {
    pthread_t thread[2];
    double sums[2] = {(double)steps, (double)steps};
    for (int i = 0; i < 2; i++) pthread_create(&thread[i], NULL, worker, &sums[i]);
    for (int i = 0; i < 2; i++) pthread_join(thread[i], NULL);
    return sums[0] == sums[1] ? 0 : 10;
}

static unsigned long long state;

static unsigned random_below(unsigned n) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (unsigned)(state >> 33) % n;
}

static double any_value(void) {
    static const double odd[] = {0.0, -0.0, 1.0, -1.0, 1e-310, 1e300, -1e308, NAN, INFINITY, -INFINITY, 20.0, -300.0, 0.5};
    return random_below(3) ? ((double)random_below(2000) - 1000.0) * 1e-6 : odd[random_below(sizeof odd / sizeof *odd)];
}

/* The results of an instance after a reset: the same as of a new one, whatever it computed before. */
static double after_reset(fmi2Component c) {
    static const unsigned some[10] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    double values[10], sum = 0.0;
    if (((Plain *)function("fmi2Reset"))(c) || ((Plain *)function("fmi2EnterInitializationMode"))(c) ||
        ((Plain *)function("fmi2ExitInitializationMode"))(c))
        exit(13);
    for (int k = 0; k < 20; k++) {
        if (((Step *)function("fmi2DoStep"))(c, 1e-3 * k, 1e-3, 1) ||
            ((Get *)function("fmi2GetReal"))(c, some, 10, values))
            exit(14);
        for (int i = 0; i < 10; i++) sum += values[i] * (i + 1 + k);
    }
    return sum;
}

/* Calls that a simulation does not need, and illegal ones. */
static fmi2Status odd_call(fmi2Component c, const unsigned *references, unsigned n, double *values, double *more) {
    static const fmi2String words[] = {"logAll", "logStatusError", "no such", NULL};
    int number = 0;
    fmi2Status status = fmi2OK;
    fmi2String text = NULL;
#define ODD(name, type, ...) return ((__typeof__(type) *)function(name))(__VA_ARGS__)
    switch (random_below(18)) {
    case 0: { typedef fmi2Status F(fmi2Component, int, double, double, int, double);
        ODD("fmi2SetupExperiment", F, c, 1, any_value(), any_value(), (int)random_below(2), any_value()); }
    case 1: { typedef fmi2Status F(fmi2Component, double); ODD("fmi2SetTime", F, c, any_value()); }
    case 2: ODD("fmi2SetContinuousStates", fmi2Status(fmi2Component, const double *, size_t), c, more,
                random_below(2) ? 10 : random_below(20));
    case 3: ODD("fmi2GetNominalsOfContinuousStates", fmi2Status(fmi2Component, double *, size_t), c, more,
                random_below(2) ? 10 : random_below(20));
    case 4: ODD("fmi2SetDebugLogging", fmi2Status(fmi2Component, int, size_t, const fmi2String *), c,
                (int)random_below(2), random_below(4), random_below(8) ? words + random_below(2) : NULL);
    case 5: ODD("fmi2GetStatus", fmi2Status(fmi2Component, int, fmi2Status *), c, (int)random_below(5), &status);
    case 6: ODD("fmi2GetRealStatus", fmi2Status(fmi2Component, int, double *), c, (int)random_below(5), more);
    case 7: ODD("fmi2GetIntegerStatus", fmi2Status(fmi2Component, int, int *), c, (int)random_below(5), &number);
    case 8: ODD("fmi2GetBooleanStatus", fmi2Status(fmi2Component, int, int *), c, (int)random_below(5), &number);
    case 9: ODD("fmi2GetStringStatus", fmi2Status(fmi2Component, int, fmi2String *), c, (int)random_below(5), &text);
    case 10: ODD("fmi2SetRealInputDerivatives", fmi2Status(fmi2Component, const unsigned *, size_t, const int *,
                                                           const double *), c, references, n, &number, values);
    case 11: ODD("fmi2GetRealOutputDerivatives", fmi2Status(fmi2Component, const unsigned *, size_t, const int *,
                                                            double *), c, references, n, &number, values);
    case 12: ODD("fmi2GetInteger", fmi2Status(fmi2Component, const unsigned *, size_t, int *), c, references,
                 random_below(2), &number);
    case 13: ODD("fmi2SetString", fmi2Status(fmi2Component, const unsigned *, size_t, const fmi2String *), c,
                 references, random_below(2), words);
    case 14: ODD("fmi2GetReal", Get, random_below(2) ? c : NULL, random_below(2) ? references : NULL, n, NULL);
    case 15: ODD("fmi2SetReal", Set, random_below(2) ? c : NULL, NULL, n, random_below(2) ? values : NULL);
    case 16: ODD("fmi2CancelStep", Plain, random_below(2) ? c : NULL);
    default: { /* must not create an instance */
        Instantiate *make = (Instantiate *)function("fmi2Instantiate");
        if (make(random_below(2) ? "" : NULL, (fmi2Type)random_below(3), guid, NULL, &callbacks, 0, 1) ||
            make("x", fmi2CoSimulation, random_below(2) ? "{no}" : NULL, NULL, &callbacks, 0, 1) ||
            make("x", (fmi2Type)7, guid, NULL, &callbacks, 0, 1) || make("x", fmi2CoSimulation, guid, NULL, NULL, 0, 1))
            exit(15);
        return fmi2OK;
    }
    }
}

/* Every function, in any order, with valid and invalid arguments. No call may crash or be fatal. */
static int fuzz(long count) {
    enum { N = 4, M = 120 };
    fmi2Component c[N] = {0}, another;
    unsigned kind[N] = {0};
    double fresh;
    fmi2FMUstate saved[N] = {0};
    unsigned references[M];
    double values[M] = {0}, more[M] = {0};
    char bytes[1 << 14];
    size_t size = 0;
    long fine = 0;
    void (*release)(fmi2Component) = (void (*)(fmi2Component))function("fmi2FreeInstance");
    for (long k = 0; k < count; k++) {
        unsigned i = random_below(N), n = random_below(6), status = 0;
        fmi2Boolean flags[2];
        fmi2EventInfo info;
        fmi2Status answer;
        if (!c[i]) {
            kind[i] = random_below(2);
            c[i] = ((Instantiate *)function("fmi2Instantiate"))("x", (fmi2Type)kind[i], guid, NULL, &callbacks, 0, 1);
            continue;
        }
        for (unsigned j = 0; j < n; j++) {
            references[j] = random_below(10) ? random_below(60) : random_below(1u << 30);
            values[j] = any_value();
        }
#define CALL(name, type, ...) status = ((type *)function(name))(c[i], ##__VA_ARGS__)
        switch (random_below(30)) {
        case 0: CALL("fmi2EnterInitializationMode", Plain); break;
        case 1: CALL("fmi2ExitInitializationMode", Plain); break;
        case 2: if (!random_below(20)) CALL("fmi2Terminate", Plain); break;
        case 3: if (!random_below(5)) CALL("fmi2Reset", Plain); break;
        case 4: case 5: case 6: CALL("fmi2SetReal", Set, references, n, values); break;
        case 7: case 8: CALL("fmi2SetReal", Set, inputs, n > 5 ? 5 : n, values); break;
        case 9: case 10: CALL("fmi2GetReal", Get, references, n, values); break;
        case 11: case 12: case 13: CALL("fmi2DoStep", Step, any_value(), any_value(), 1); break;
        case 14: {
            typedef fmi2Status Derivative(fmi2Component, const unsigned *, size_t, const unsigned *, size_t,
                                          const double *, double *);
            CALL("fmi2GetDirectionalDerivative", Derivative, references, n / 2, references + n / 2, n - n / 2, values,
                 more);
            break;
        }
        case 15: { typedef fmi2Status F(fmi2Component, fmi2FMUstate *); CALL("fmi2GetFMUstate", F, &saved[i]); break; }
        case 16: {
            typedef fmi2Status F(fmi2Component, fmi2FMUstate);
            CALL("fmi2SetFMUstate", F, saved[random_below(N)]);
            break;
        }
        case 17: { typedef fmi2Status F(fmi2Component, fmi2FMUstate *); CALL("fmi2FreeFMUstate", F, &saved[i]); break; }
        case 18: {
            typedef fmi2Status F(fmi2Component, fmi2FMUstate, size_t *);
            typedef fmi2Status G(fmi2Component, fmi2FMUstate, char *, size_t);
            CALL("fmi2SerializedFMUstateSize", F, saved[i], &size);
            if (status == fmi2OK && size <= sizeof bytes) CALL("fmi2SerializeFMUstate", G, saved[i], bytes, size);
            break;
        }
        case 19: {
            typedef fmi2Status F(fmi2Component, const char *, size_t, fmi2FMUstate *);
            if (size && size <= sizeof bytes) {
                if (random_below(2)) bytes[random_below((unsigned)size)] ^= (char)(1 << random_below(8));
                CALL("fmi2DeSerializeFMUstate", F, bytes, random_below(4) ? size : random_below(1000), &saved[i]);
            }
            break;
        }
        case 20: CALL("fmi2EnterContinuousTimeMode", Plain); break;
        case 21: CALL("fmi2EnterEventMode", Plain); break;
        case 22: {
            typedef fmi2Status F(fmi2Component, double *, size_t);
            CALL(random_below(2) ? "fmi2GetDerivatives" : "fmi2GetContinuousStates", F, more, random_below(20));
            CALL("fmi2GetEventIndicators", F, more, random_below(5));
            break;
        }
        case 23: {
            typedef fmi2Status F(fmi2Component, fmi2EventInfo *);
            CALL("fmi2NewDiscreteStates", F, &info);
            break;
        }
        case 24: {
            typedef fmi2Status F(fmi2Component, int, int *, int *);
            CALL("fmi2CompletedIntegratorStep", F, 1, &flags[0], &flags[1]);
            break;
        }
        case 25: case 26: case 27: status = odd_call(c[i], references, n, values, more); break;
        default:
            if (!random_below(50)) {
                for (unsigned j = 0; j < N; j++)
                    ((fmi2Status(*)(fmi2Component, fmi2FMUstate *))function("fmi2FreeFMUstate"))(c[i], &saved[j]);
                release(c[i]);
                c[i] = NULL;
            }
        }
        answer = (fmi2Status)status;
        if (answer == fmi2Fatal || answer == fmi2Pending) return 11;
        fine += answer == fmi2OK;
    }
    another = start(fmi2CoSimulation);
    fresh = after_reset(another);
    release(another);
    for (unsigned i = 0; i < N; i++)
        if (c[i]) {
            if (kind[i] == fmi2CoSimulation && after_reset(c[i]) != fresh) return 16;
            for (unsigned j = 0; j < N; j++)
                ((fmi2Status(*)(fmi2Component, fmi2FMUstate *))function("fmi2FreeFMUstate"))(c[i], &saved[j]);
            release(c[i]);
        }
    printf("%ld\n", fine);
    return fine > count / 4 ? 0 : 12;
}

static int measure(long steps) {
    fmi2Component c = start(fmi2CoSimulation);
    Set *set = (Set *)function("fmi2SetReal");
    Step *step = (Step *)function("fmi2DoStep");
    Get *get = (Get *)function("fmi2GetReal");
    double u[5], y, best = 1e9;
    for (int round = 0; round < 20; round++) {
        struct timespec a, b;
        angles(0, u);
        clock_gettime(CLOCK_MONOTONIC, &a);
        for (long k = 0; k < steps; k++) {
            u[2] -= k % 400 < 200 ? 1e-5 : -1e-5;
            set(c, inputs, 5, u);
            step(c, 0.0, 1e-3, 1);
            get(c, &output, 1, &y);
        }
        clock_gettime(CLOCK_MONOTONIC, &b);
        double time = ((double)(b.tv_sec - a.tv_sec) * 1e6 + (double)(b.tv_nsec - a.tv_nsec) * 1e-3) / (double)steps;
        if (time < best) best = time;
    }
    ((void (*)(fmi2Component))function("fmi2FreeInstance"))(c);
    printf("%.4f\n", best);
    return 0;
}

int main(int count, char **words) {
    if (count < 5) return 1;
    guid = words[2];
    if (!strcmp(words[3], "loop")) return loop(words[1], atol(words[4]), count > 5 ? atol(words[5]) : 0);
    library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 2;
    }
    state = count > 5 ? (unsigned long long)atol(words[5]) : 1;
    if (!strcmp(words[3], "fuzz")) return fuzz(atol(words[4]));
    if (!strcmp(words[3], "threads")) return threads(atol(words[4]));
    return measure(atol(words[4]));
}
