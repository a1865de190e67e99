/* A host without Python: steps an FMU through a record of inputs; prints its outputs, or how long it takes.

   host LIBRARY RESOURCES GUID RECORD INPUTS FIRST_OUTPUT OUTPUTS H ROUNDS [REFERENCE=VALUE]...

   RESOURCES is the address of the FMU's folder of that name, for those that have one. RECORD is a file of doubles,
   INPUTS of them per step: the values of the value references from 0 on. OUTPUTS are those from FIRST_OUTPUT on. With
   ROUNDS = 0 it prints one line per step: the outputs, 17 digits. Otherwise it goes that many times through the record
   and prints the mean processor time of setting the inputs, fmi2DoStep and getting the outputs, in ns. REFERENCE=VALUE
   sets a Real parameter before. It is linked without the mathematical library, so that an FMU has to bring its own. */

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

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

#define MOST 512 /* inputs, outputs */

typedef struct {
    fmi2Component instance;
    fmi2SetRealTYPE *set_real;
    fmi2DoStepTYPE *do_step;
    fmi2GetRealTYPE *get_real;
    fmi2TerminateTYPE *terminate;
    fmi2FreeInstanceTYPE *free_instance;
    fmi2ValueReference inputs_at[MOST], outputs_at[MOST];
    size_t inputs, outputs;
    double h;
} Fmu;

static void stop(const char *what, const char *which) {
    fprintf(stderr, "%s %s\n", what, which);
    exit(1);
}

static void *find(void *library, const char *name) {
    void *function = FIND(library, name);
    if (!function) stop("the library has no", name);
    return function;
}

/* A step that warns of missing inputs has been made. */
static void require(fmi2Status status, const char *what) {
    if (status != fmi2OK && status != fmi2Warning) stop("an error was returned by", what);
}

static void print_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                          fmi2String category, fmi2String message, ...) {
    (void)environment;
    fprintf(stderr, "%s %d %s: %s\n", name, status, category, message);
}

static void start(Fmu *fmu, const char *path, const char *resources, const char *guid, int count, char **settings) {
    static const fmi2CallbackFunctions callbacks = {print_message, calloc, free, NULL, NULL};
    void *library = OPEN(path);
    if (!library) stop("cannot load", path);
    fmu->set_real = (fmi2SetRealTYPE *)find(library, "fmi2SetReal");
    fmu->do_step = (fmi2DoStepTYPE *)find(library, "fmi2DoStep");
    fmu->get_real = (fmi2GetRealTYPE *)find(library, "fmi2GetReal");
    fmu->terminate = (fmi2TerminateTYPE *)find(library, "fmi2Terminate");
    fmu->free_instance = (fmi2FreeInstanceTYPE *)find(library, "fmi2FreeInstance");
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)find(library, "fmi2Instantiate");
    fmi2Component c = instantiate("host", fmi2CoSimulation, guid, resources, &callbacks, fmi2False, fmi2True);
    if (!c) stop("cannot instantiate", path);
    fmu->instance = c;
    for (int i = 0; i < count; i++) {
        unsigned reference;
        double value;
        if (sscanf(settings[i], "%u=%lf", &reference, &value) != 2) stop("not REFERENCE=VALUE:", settings[i]);
        require(fmu->set_real(c, &reference, 1, &value), settings[i]);
    }
    require(((fmi2SetupExperimentTYPE *)find(library, "fmi2SetupExperiment"))(c, 0, 0.0, 0.0, 0, 0.0), "setup");
    require(((fmi2EnterInitializationModeTYPE *)find(library, "fmi2EnterInitializationMode"))(c), "enter");
    require(((fmi2ExitInitializationModeTYPE *)find(library, "fmi2ExitInitializationMode"))(c), "exit");
}

/* Rows of a file of doubles. */
static double *read_record(const char *path, size_t width, size_t *rows) {
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) stop("cannot read", path);
    size_t size = (size_t)ftell(file);
    double *record = malloc(size);
    rewind(file);
    if (!record || fread(record, 1, size, file) != size) stop("cannot read", path);
    fclose(file);
    *rows = size / sizeof(double) / width;
    return record;
}

/* Step number k, with these inputs. */
static void step(Fmu *fmu, size_t k, const double *u, double *y) {
    require(fmu->set_real(fmu->instance, fmu->inputs_at, fmu->inputs, u), "fmi2SetReal");
    require(fmu->do_step(fmu->instance, (double)k * fmu->h, fmu->h, fmi2True), "fmi2DoStep");
    require(fmu->get_real(fmu->instance, fmu->outputs_at, fmu->outputs, y), "fmi2GetReal");
}

static void print_outputs(Fmu *fmu, const double *record, size_t rows) {
    double y[MOST];
    for (size_t k = 0; k < rows; k++) {
        step(fmu, k, record + k * fmu->inputs, y);
        for (size_t i = 0; i < fmu->outputs; i++) printf("%.17g%c", y[i], i + 1 < fmu->outputs ? ' ' : '\n');
    }
}

static void print_time(Fmu *fmu, const double *record, size_t rows, size_t rounds) {
    double y[MOST];
    clock_t began = clock();
    for (size_t round = 0; round < rounds; round++) {
        for (size_t k = 0; k < rows; k++) step(fmu, round * rows + k, record + k * fmu->inputs, y);
    }
    printf("%.17g\n", 1e9 * (double)(clock() - began) / CLOCKS_PER_SEC / (double)(rows * rounds));
}

int main(int count, char **arguments) {
    static Fmu fmu;
    if (count < 10) stop("too few arguments for", arguments[0]);
    fmu.inputs = (size_t)atoi(arguments[5]);
    fmu.outputs = (size_t)atoi(arguments[7]);
    fmu.h = strtod(arguments[8], NULL);
    if (fmu.inputs > MOST || fmu.outputs > MOST) stop("too many inputs or", "outputs");
    for (unsigned i = 0; i < MOST; i++) {
        fmu.inputs_at[i] = i;
        fmu.outputs_at[i] = (unsigned)atoi(arguments[6]) + i;
    }
    start(&fmu, arguments[1], arguments[2], arguments[3], count - 10, arguments + 10);
    size_t rows, rounds = (size_t)atoi(arguments[9]);
    double *record = read_record(arguments[4], fmu.inputs ? fmu.inputs : 1, &rows);
    if (rounds) {
        print_time(&fmu, record, rows, rounds);
    } else {
        print_outputs(&fmu, record, rows);
    }
    if (fflush(stdout) != 0) return 1;
    require(fmu.terminate(fmu.instance), "fmi2Terminate");
    fmu.free_instance(fmu.instance);
    return 0;
}
