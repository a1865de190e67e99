/* FMI functions: get and set variables, derivatives of outputs. */

#define READABLE (INITIALISING | STEPPING | TERMINATED)
#define WRITABLE (INSTANTIATED | INITIALISING | STEPPING)

/* Let the outputs follow what was set since they were calculated: masters exchange them during initialisation too. */
static void bring_up_to_date(Instance *c) {
    if (!c->state.stale) return;
    if (c->state.phase == STEPPING) engine_refresh(c);
    if (c->state.phase == INITIALISING && parameters_are_good(c)) engine_initialise(c);
    c->state.stale = false;
}

static bool are_readable(Instance *c, const char *function, const fmi2ValueReference vr[], size_t n, Type type,
                         const void *values) {
    if (!in_phase(c, function, READABLE)) return false;
    if (!is_given(c, function, vr, n) || !is_given(c, function, values, n)) return false;
    if (type != REAL || !are_results(vr, n)) {
        for (size_t i = 0; i < n; i++) {
            if (!find(c, vr[i], type)) return false;
        }
    }
    bring_up_to_date(c);
    return true;
}

/* Element i of an array that a host gave, and what it is to hold. */
static double element(Type type, const void *values, size_t i) {
    switch (type) {
        case REAL: return ((const fmi2Real *)values)[i];
        case INTEGER: return ((const fmi2Integer *)values)[i];
        default: return ((const fmi2Boolean *)values)[i] != fmi2False;
    }
}

static void put(Type type, void *values, size_t i, double value) {
    switch (type) {
        case REAL: ((fmi2Real *)values)[i] = value; break;
        case INTEGER: ((fmi2Integer *)values)[i] = (fmi2Integer)value; break;
        default: ((fmi2Boolean *)values)[i] = value != 0.0;
    }
}

static fmi2Status get(Instance *c, const char *function, Type type, const fmi2ValueReference vr[], size_t n,
                      void *values) {
    if (!are_readable(c, function, vr, n, type, values)) return fmi2Error;
    for (size_t i = 0; i < n; i++) put(type, values, i, c->state.values[vr[i]]);
    return fmi2OK;
}

/* All values or none: each is checked before the first is set. */
static fmi2Status set(Instance *c, const char *function, Type type, const fmi2ValueReference vr[], size_t n,
                      const void *values) {
    if (!in_phase(c, function, WRITABLE)) return fmi2Error;
    if (!is_given(c, function, vr, n) || !is_given(c, function, values, n)) return fmi2Error;
    if (type != REAL || !are_inputs(vr, n)) {
        for (size_t i = 0; i < n; i++) {
            if (!is_settable(c, vr[i], type, element(type, values, i))) return fmi2Error;
        }
    }
    for (size_t i = 0; i < n; i++) c->state.values[vr[i]] = element(type, values, i);
    c->state.stale = true;
    return fmi2OK;
}

static fmi2Status no_strings(Instance *c, const char *function, size_t n) {
    if (!in_phase(c, function, READABLE | WRITABLE)) return fmi2Error;
    return n == 0 ? fmi2OK : refuse(c, "there are no string variables");
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    return get(instance_of(c), "fmi2GetReal", REAL, vr, n, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    return get(instance_of(c), "fmi2GetInteger", INTEGER, vr, n, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    return get(instance_of(c), "fmi2GetBoolean", BOOLEAN, vr, n, value);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(instance_of(c), "fmi2GetString", n);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    return set(instance_of(c), "fmi2SetReal", REAL, vr, n, value);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    return set(instance_of(c), "fmi2SetInteger", INTEGER, vr, n, value);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    return set(instance_of(c), "fmi2SetBoolean", BOOLEAN, vr, n, value);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(instance_of(c), "fmi2SetString", n);
}

/* Of outputs with respect to inputs. A continuous block answers for the present time, a sampled one for its last sample
   and the inputs of that sample: between samples its outputs are held. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real d_known[],
                                        fmi2Real d_unknown[]) {
    const char *function = "fmi2GetDirectionalDerivative";
    Instance *c = instance_of(component);
    double du[N_INPUTS + 1] = {0}, dy[N_OUTPUTS + 1];
    if (!are_readable(c, function, unknown, n_unknown, REAL, d_unknown)) return fmi2Error;
    if (!are_readable(c, function, known, n_known, REAL, d_known)) return fmi2Error;
    for (size_t i = 0; i < n_unknown; i++) {
        const Variable *v = &VARIABLES[unknown[i]];
        if (v->role != OUTPUT) return refuse(c, "%s: %s is not an output", function, v->name);
    }
    for (size_t i = 0; i < n_known; i++) {
        const Variable *v = &VARIABLES[known[i]];
        if (v->role != INPUT) return refuse(c, "%s: %s is not an input", function, v->name);
        du[known[i]] += d_known[i];
    }
    engine_derivative(c, du, dy);
    for (size_t i = 0; i < n_unknown; i++) {
        d_unknown[i] = unknown[i] == SAMPLE_TIME ? 0.0 : dy[unknown[i] - N_INPUTS - N_PARAMETERS];
    }
    return fmi2OK;
}
