/* A host without Python: loads a native FMU, steps it, and prints what it reports.

   host LIBRARY GUID STEPS H INPUTS FIRST_OUTPUT OUTPUTS

   In step k input i (value reference i) is ((i + 3 k) mod 7 - 3) / 4. Prints one line per step: the outputs, 17 digits.
   It is linked without the mathematical library, so that an FMU has to bring its own. */

#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

#define MOST 256

static void *find(void *library, const char *name) {
    void *function = FIND(library, name);
    if (!function) {
        fprintf(stderr, "no %s\n", name);
        exit(1);
    }
    return function;
}

static void require(int status, const char *what) {
    if (status != fmi2OK) {
        fprintf(stderr, "%s returned %d\n", what, status);
        exit(1);
    }
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                          fmi2String category, fmi2String message, ...) {
    (void)environment;
    fprintf(stderr, "%s %d %s: %s\n", name, status, category, message);
}

int main(int count, char **arguments) {
    if (count != 8) return 2;
    void *library = OPEN(arguments[1]);
    if (!library) {
        fprintf(stderr, "cannot load %s\n", arguments[1]);
        return 1;
    }
    const char *guid = arguments[2];
    int steps = atoi(arguments[3]), inputs = atoi(arguments[5]), first = atoi(arguments[6]), outputs = atoi(arguments[7]);
    double h = strtod(arguments[4], NULL), u[MOST], y[MOST];
    fmi2ValueReference u_at[MOST], y_at[MOST];
    for (int i = 0; i < MOST; i++) {
        u_at[i] = (fmi2ValueReference)i;
        y_at[i] = (fmi2ValueReference)(first + i);
    }
    fmi2CallbackFunctions callbacks = {print_message, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *instantiate = find(library, "fmi2Instantiate");
    fmi2Component c = instantiate("host", fmi2CoSimulation, guid, "", &callbacks, fmi2False, fmi2True);
    if (!c) return 1;
    require(((fmi2SetupExperimentTYPE *)find(library, "fmi2SetupExperiment"))(c, 0, 0.0, 0.0, 0, 0.0), "setup");
    require(((fmi2EnterInitializationModeTYPE *)find(library, "fmi2EnterInitializationMode"))(c), "enter");
    require(((fmi2ExitInitializationModeTYPE *)find(library, "fmi2ExitInitializationMode"))(c), "exit");
    fmi2SetRealTYPE *set_real = find(library, "fmi2SetReal");
    fmi2GetRealTYPE *get_real = find(library, "fmi2GetReal");
    fmi2DoStepTYPE *do_step = find(library, "fmi2DoStep");
    for (int k = 0; k < steps; k++) {
        for (int i = 0; i < inputs; i++) u[i] = ((i + 3 * k) % 7 - 3) / 4.0;
        require(set_real(c, u_at, (size_t)inputs, u), "fmi2SetReal");
        require(do_step(c, k * h, h, fmi2True), "fmi2DoStep");
        require(get_real(c, y_at, (size_t)outputs, y), "fmi2GetReal");
        for (int i = 0; i < outputs; i++) printf("%.17g%c", y[i], i + 1 < outputs ? ' ' : '\n');
    }
    require(((fmi2TerminateTYPE *)find(library, "fmi2Terminate"))(c), "fmi2Terminate");
    ((fmi2FreeInstanceTYPE *)find(library, "fmi2FreeInstance"))(c);
    return 0;
}
