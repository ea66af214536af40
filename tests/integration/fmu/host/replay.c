/* A host that replays a signal in co-simulation, in repeated cycles. It also compiles for Windows.

   replay LIBRARY GUID SIGNAL RESULT ROUNDS

   SIGNAL, doubles: number of inputs, of rows, of results, whether every row is written (else the last of each cycle);
   value references of the results; then rows of a step (s) and the inputs, the first for initialisation. RESULT,
   doubles: the results after initialisation and after every row, or every cycle. Inputs are references 0, 1, ... */

#include <stdio.h>
#include <stdlib.h>

#include "fmi2_api.h"

#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return (void *)LoadLibraryA(path); }
static void *find(void *library, const char *name) { return (void *)GetProcAddress((HMODULE)library, name); }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
#endif

static void say(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)c;
    fprintf(stderr, "%d %s\n", (int)s, m);
}

static double *load(const char *path, size_t *count) {
    FILE *file = fopen(path, "rb");
    double *values;
    if (!file) exit(20);
    fseek(file, 0, SEEK_END);
    *count = (size_t)ftell(file) / sizeof(double);
    rewind(file);
    values = malloc(*count * sizeof(double));
    if (!values || fread(values, sizeof(double), *count, file) != *count) exit(21);
    fclose(file);
    return values;
}

int main(int n_words, char **words) {
    static const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};
    enum { MOST = 200 };
    unsigned inputs[MOST], references[MOST];
    double results[MOST], time = 0.0, *signal, *row;
    size_t count, n_inputs, n_rows, n_results, every;
    long rounds;
    void *library, *c;
    FILE *file;
    if (n_words != 6) return 1;
    library = open_library(words[1]);
    if (!library) return 2;
    signal = load(words[3], &count);
    n_inputs = (size_t)signal[0], n_rows = (size_t)signal[1], n_results = (size_t)signal[2], every = signal[3] != 0.0;
    rounds = atol(words[5]);
    if (n_inputs > MOST || n_results > MOST || count != 4 + n_results + n_rows * (n_inputs + 1)) return 3;
    for (size_t k = 0; k < n_inputs; k++) inputs[k] = (unsigned)k;
    for (size_t k = 0; k < n_results; k++) references[k] = (unsigned)signal[4 + k];
    signal += 4 + n_results;
#define GET(type, name) type name = (type)find(library, "fmi2" #name); if (!name) return 4
    typedef void *New(const char *, fmi2Type, const char *, const char *, const fmi2CallbackFunctions *, int, int);
    typedef fmi2Status Plain(void *);
    typedef fmi2Status Set(void *, const unsigned *, size_t, const double *);
    typedef fmi2Status Read(void *, const unsigned *, size_t, double *);
    typedef fmi2Status Step(void *, double, double, int);
    GET(New *, Instantiate);
    GET(Plain *, EnterInitializationMode);
    GET(Plain *, ExitInitializationMode);
    GET(Plain *, FreeInstance);
    GET(Set *, SetReal);
    GET(Read *, GetReal);
    GET(Step *, DoStep);
    file = fopen(words[4], "wb");
    c = Instantiate("replay", fmi2CoSimulation, words[2], "", &callbacks, 0, 1);
    if (!c || !file) return 5;
    if (EnterInitializationMode(c) || SetReal(c, inputs, n_inputs, signal + 1) || ExitInitializationMode(c)) return 6;
    if (GetReal(c, references, n_results, results)) return 7;
    fwrite(results, sizeof(double), n_results, file);
    for (long round = 0; round < rounds; round++)
        for (size_t k = 1; k < n_rows; k++) {
            row = signal + k * (n_inputs + 1);
            if (SetReal(c, inputs, n_inputs, row + 1) || DoStep(c, time, row[0], 1)) return 8;
            time += row[0];
            if (!every && k + 1 < n_rows) continue;
            if (GetReal(c, references, n_results, results)) return 9;
            fwrite(results, sizeof(double), n_results, file);
        }
    FreeInstance(c);
    return fclose(file) ? 10 : 0;
}
