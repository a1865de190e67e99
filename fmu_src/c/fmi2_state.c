/* FMI functions: the whole state, kept in memory or as bytes. */

typedef struct {
    char guid[40]; /* of the block that it belongs to */
    State state;
} Snapshot;

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *kept) {
    Instance *c = component;
    if (!c) return fmi2Error;
    if (!kept) return refuse(c, "fmi2GetFMUstate got no place for the state");
    if (!*kept) *kept = calloc(1, sizeof(Snapshot));
    Snapshot *snapshot = *kept;
    if (!snapshot) return refuse(c, "out of memory");
    memcpy(snapshot->guid, MODEL_GUID, sizeof MODEL_GUID);
    snapshot->state = c->state;
    return fmi2OK;
}

/* Whether a snapshot is one of this block. Bytes that the host kept may be anything. */
static bool is_ours(const Snapshot *snapshot) {
    if (memcmp(snapshot->guid, MODEL_GUID, sizeof MODEL_GUID) != 0) return false;
    for (int i = 0; i < N_VARIABLES; i++) {
        double value = snapshot->state.values[i];
        if (VARIABLES[i].type != REAL && !(INT32_MIN <= value && value <= INT32_MAX)) return false;
    }
    switch (snapshot->state.phase) {
        case INSTANTIATED:
        case INITIALISING:
        case STEPPING:
        case TERMINATED: return true;
        default: return false;
    }
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate kept) {
    Instance *c = component;
    if (!c) return fmi2Error;
    if (!kept || !is_ours(kept)) return refuse(c, "the state is that of another FMU and was not set");
    c->state = ((Snapshot *)kept)->state;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component component, fmi2FMUstate *kept) {
    if (!component) return fmi2Error;
    if (kept) {
        free(*kept);
        *kept = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component component, fmi2FMUstate kept, size_t *size) {
    Instance *c = component;
    if (!c) return fmi2Error;
    if (!kept || !size) return refuse(c, "fmi2SerializedFMUstateSize got no state");
    *size = sizeof(Snapshot);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component component, fmi2FMUstate kept, fmi2Byte bytes[], size_t size) {
    Instance *c = component;
    if (!c) return fmi2Error;
    if (!kept || !bytes || size < sizeof(Snapshot)) {
        return refuse(c, "fmi2SerializeFMUstate got no state, or less room than its %u bytes", (unsigned)sizeof(Snapshot));
    }
    memcpy(bytes, kept, sizeof(Snapshot));
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *kept) {
    Instance *c = component;
    Snapshot snapshot;
    if (!c) return fmi2Error;
    if (!bytes || !kept || size != sizeof snapshot) {
        return refuse(c, "a serialised state has %u bytes, not %u", (unsigned)sizeof snapshot, (unsigned)size);
    }
    memcpy(&snapshot, bytes, sizeof snapshot);
    if (!is_ours(&snapshot)) return refuse(c, "the serialised state is that of another FMU or another build");
    if (!*kept) *kept = calloc(1, sizeof snapshot);
    if (!*kept) return refuse(c, "out of memory");
    memcpy(*kept, &snapshot, sizeof snapshot);
    return fmi2OK;
}
