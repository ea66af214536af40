/* once LIBRARY GUID RESOURCES [free]: load, instantiate, initialise, one step; with "free" also free it. */

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2_api.h"

static void *library;

static void say(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)c;
    fprintf(stderr, "%d %s\n", (int)s, m);
}

static const fmi2CallbackFunctions callbacks = {say, calloc, free, NULL, NULL};

typedef fmi2Component Instantiate(fmi2String, int, fmi2String, fmi2String, const fmi2CallbackFunctions *, int, int);
typedef int Plain(fmi2Component);
typedef void Last(fmi2Component);
typedef int Setup(fmi2Component, int, double, double, int, double);
typedef int Step(fmi2Component, double, double, int);

int main(int argc, char **argv) {
    if (argc < 4) return 2;
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        fprintf(stderr, "%s\n", dlerror());
        return 3;
    }
    fmi2Component c = ((Instantiate *)dlsym(library, "fmi2Instantiate"))("x", 1, argv[2], argv[3], &callbacks, 0, 1);
    if (!c) return 4;
    ((Setup *)dlsym(library, "fmi2SetupExperiment"))(c, 0, 0, 0, 0, 0);
    ((Plain *)dlsym(library, "fmi2EnterInitializationMode"))(c);
    if (((Plain *)dlsym(library, "fmi2ExitInitializationMode"))(c)) return 5;
    if (((Step *)dlsym(library, "fmi2DoStep"))(c, 0.0, 1e-4, 1)) return 6;
    if (argc > 4) {
        ((Plain *)dlsym(library, "fmi2Terminate"))(c);
        ((Last *)dlsym(library, "fmi2FreeInstance"))(c);
    }
    return 0;
}
