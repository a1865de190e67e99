/* What a call must fulfil before it changes anything. */

static const char *phase_name(int64_t phase) {
    switch (phase) {
        case INSTANTIATED: return "before initialisation";
        case INITIALISING: return "during initialisation";
        case STEPPING: return "once the simulation runs";
        default: return "after fmi2Terminate";
    }
}

/* Whether a function may be called in the present phase. phases: the sum of those in which it may. */
static bool in_phase(Instance *c, const char *function, int phases) {
    if (!c) return false;
    if (c->state.phase & phases) return true;
    refuse(c, "%s cannot be called %s", function, phase_name(c->state.phase));
    return false;
}

/* Whether an argument array of n elements is there. */
static bool is_given(Instance *c, const char *function, const void *array, size_t n) {
    if (array || n == 0) return true;
    refuse(c, "%s got no array", function);
    return false;
}

static bool is_parameter(const Variable *v) { return v->role == FIXED || v->role == TUNABLE; }

static bool in_range(const Variable *v, double value) { return v->minimum <= value && value <= v->maximum; }

/* Describe every parameter out of its range in text; empty if there is none. */
static void describe_bad_parameters(Instance *c, char *text, size_t size) {
    size_t n = 0;
    text[0] = '\0';
    for (int i = 0; i < N_VARIABLES && n < size; i++) {
        const Variable *v = &VARIABLES[i];
        double value = c->state.values[i];
        if (!is_parameter(v) || in_range(v, value)) continue;
        n += (size_t)snprintf(text + n, size - n, "%s%s = %g%s is outside [%g, %g]%s", n ? "; " : "", v->name, value,
                              v->unit, v->minimum, v->maximum, v->unit);
    }
}

static bool parameters_are_good(Instance *c) {
    for (int i = N_INPUTS; i < N_INPUTS + N_PARAMETERS; i++) {
        if (!in_range(&VARIABLES[i], c->state.values[i])) return false;
    }
    return true;
}

/* The variable with this value reference and type, or NULL with a message. */
static const Variable *find(Instance *c, fmi2ValueReference reference, Type type) {
    static const char *const NAMES[] = {"Real", "Integer", "Boolean"};
    if (reference >= N_VARIABLES) {
        refuse(c, "no variable has value reference %u", reference);
        return NULL;
    }
    const Variable *v = &VARIABLES[reference];
    if (v->type == type) return v;
    refuse(c, "%s is %s, not %s", v->name, NAMES[v->type], NAMES[type]);
    return NULL;
}

/* Whether a variable may take this value now; if not, it keeps its value. */
static bool is_settable(Instance *c, fmi2ValueReference reference, Type type, double value) {
    const Variable *v = find(c, reference, type);
    if (!v) return false;
    if (v->role == OUTPUT || v->role == LOCAL) {
        refuse(c, "%s is calculated and cannot be set", v->name);
        return false;
    }
    if (c->state.phase != STEPPING || v->role == INPUT) return true;
    double kept = c->state.values[reference];
    if (v->role == FIXED) {
        refuse(c, "%s is fixed once the simulation runs; it keeps %g", v->name, kept);
        return false;
    }
    if (in_range(v, value)) return true;
    refuse(c, "%s = %g%s is outside [%g, %g]%s; it keeps %g", v->name, value, v->unit, v->minimum, v->maximum, v->unit,
           kept);
    return false;
}

/* What is set and read at every step needs no look at the table, whose rows are wide: the value reference of an input or
   of a result tells by itself that the variable is Real, and an input takes any value at any time. */

static bool are_inputs(const fmi2ValueReference vr[], size_t n) {
#if N_INPUTS > 0
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= N_INPUTS) return false;
    }
    return true;
#else
    (void)vr;
    return n == 0;
#endif
}

/* Whether all are outputs or locals. */
static bool are_results(const fmi2ValueReference vr[], size_t n) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] < N_INPUTS + N_PARAMETERS || vr[i] >= N_VARIABLES) return false;
    }
    return true;
}
