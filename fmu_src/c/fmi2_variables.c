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

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    if (!are_readable(c, "fmi2GetReal", vr, n, REAL, value)) return fmi2Error;
    for (size_t i = 0; i < n; i++) value[i] = ((Instance *)c)->state.values[vr[i]];
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    if (!are_readable(c, "fmi2GetInteger", vr, n, INTEGER, value)) return fmi2Error;
    for (size_t i = 0; i < n; i++) value[i] = (fmi2Integer)((Instance *)c)->state.values[vr[i]];
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    if (!are_readable(c, "fmi2GetBoolean", vr, n, BOOLEAN, value)) return fmi2Error;
    for (size_t i = 0; i < n; i++) value[i] = ((Instance *)c)->state.values[vr[i]] != 0.0;
    return fmi2OK;
}

static fmi2Status no_strings(Instance *c, const char *function, size_t n) {
    if (!in_phase(c, function, READABLE | WRITABLE)) return fmi2Error;
    return n == 0 ? fmi2OK : refuse(c, "there are no string variables");
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(c, "fmi2GetString", n);
}

/* All values or none: each is checked before the first is set. */
static bool are_writable(Instance *c, const char *function, const fmi2ValueReference vr[], size_t n,
                         const void *values) {
    return in_phase(c, function, WRITABLE) && is_given(c, function, vr, n) && is_given(c, function, values, n);
}

fmi2Status fmi2SetReal(fmi2Component component, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    Instance *c = component;
    if (!are_writable(c, "fmi2SetReal", vr, n, value)) return fmi2Error;
    if (!are_inputs(vr, n)) {
        for (size_t i = 0; i < n; i++) {
            if (!is_settable(c, vr[i], REAL, value[i])) return fmi2Error;
        }
    }
    for (size_t i = 0; i < n; i++) c->state.values[vr[i]] = value[i];
    c->state.stale = true;
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component component, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    Instance *c = component;
    if (!are_writable(c, "fmi2SetInteger", vr, n, value)) return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (!is_settable(c, vr[i], INTEGER, value[i])) return fmi2Error;
    }
    for (size_t i = 0; i < n; i++) c->state.values[vr[i]] = value[i];
    c->state.stale = true;
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component component, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    Instance *c = component;
    if (!are_writable(c, "fmi2SetBoolean", vr, n, value)) return fmi2Error;
    for (size_t i = 0; i < n; i++) {
        if (!is_settable(c, vr[i], BOOLEAN, value[i] != 0)) return fmi2Error;
    }
    for (size_t i = 0; i < n; i++) c->state.values[vr[i]] = value[i] != 0;
    c->state.stale = true;
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
    (void)vr, (void)value;
    return no_strings(c, "fmi2SetString", n);
}

/* Of outputs with respect to inputs. A continuous block answers for the present time, a sampled one for its last sample
   and the inputs of that sample: between samples its outputs are held. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component component, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real d_known[],
                                        fmi2Real d_unknown[]) {
    const char *function = "fmi2GetDirectionalDerivative";
    Instance *c = component;
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
