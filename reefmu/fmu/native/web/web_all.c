/* The drive as a WebAssembly module for the page in the FMU's documentation: the same model without the functions of
   FMI, one instance, and no imports. The page writes inputs and parameters into `values` by value reference. */

#define FMI2_EXPORT static
#define WEB_EXPORT(name) __attribute__((export_name(#name)))
#include "fmi2_all.c"

static Instance instance;

WEB_EXPORT(values) double *web_values(void) { return instance.now.values; }

/* Start values. */
WEB_EXPORT(reset) void web_reset(void) { set_start_values(&instance, fmi2CoSimulation); }

/* States and outputs that are consistent with inputs and parameters; returns 0 where they are not finite. */
WEB_EXPORT(initialise) int web_initialise(void) {
    instance.now.phase = STEPPING;
    instance.now.stale = STALE_ALL;
    memset(&instance.now.contact, 0, sizeof instance.now.contact);
    return refresh(&instance, STALE_ALL);
}

/* States and outputs after dt seconds at constant inputs; returns 0, and changes nothing, where they are not finite. */
WEB_EXPORT(step) int web_step(double dt) { return advance_step(&instance, dt); }
