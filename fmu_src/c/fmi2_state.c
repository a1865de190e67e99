/* FMI functions: the whole state, kept in memory or as bytes. */

/* Begins with a null pointer for hosts that free a state through the state itself instead of through a pointer to it, as
   fmusim does: what they free is then nothing, and they live. */
typedef struct {
    void *nothing;
    char guid[40];     /* of the block that it belongs to */
    uint64_t checksum; /* of a serialised state: the host may have changed its bytes */
    State state;
} Snapshot;

/* FNV-1a: another byte anywhere gives another number. */
static uint64_t checksum(const State *state) {
    const unsigned char *bytes = (const unsigned char *)state;
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < sizeof *state; i++) sum = (sum ^ bytes[i]) * 1099511628211u;
    return sum;
}

static bool is_ours(const Snapshot *snapshot) {
    return !snapshot->nothing && memcmp(snapshot->guid, MODEL_GUID, sizeof MODEL_GUID) == 0;
}

/* The snapshot that a host keeps, a new one if it has none yet; NULL with a message if there is no memory. */
static Snapshot *room_for(Instance *c, fmi2FMUstate *kept) {
    if (!*kept) *kept = calloc(1, sizeof(Snapshot));
    if (!*kept) refuse(c, "out of memory");
    return (Snapshot *)*kept;
}

fmi2Status fmi2GetFMUstate(fmi2Component component, fmi2FMUstate *kept) {
    Instance *c = instance_of(component);
    if (!c) return fmi2Error;
    if (!kept) return refuse(c, "fmi2GetFMUstate got no place for the state");
    Snapshot *snapshot = room_for(c, kept);
    if (!snapshot) return fmi2Error;
    memcpy(snapshot->guid, MODEL_GUID, sizeof MODEL_GUID);
    snapshot->state = c->state;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component component, fmi2FMUstate kept) {
    Instance *c = instance_of(component);
    const Snapshot *snapshot = (const Snapshot *)kept;
    if (!c) return fmi2Error;
    if (!snapshot || !is_ours(snapshot)) return refuse(c, "the state is that of another FMU and was not set");
    c->state = snapshot->state;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    if (!c) return fmi2Error;
    if (kept) {
        free(*kept);
        *kept = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate kept, size_t *size) {
    if (!c) return fmi2Error;
    if (!kept || !size) return refuse(instance_of(c), "fmi2SerializedFMUstateSize got no state");
    *size = sizeof(Snapshot);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate kept, fmi2Byte bytes[], size_t size) {
    if (!c) return fmi2Error;
    if (!kept || !bytes || size < sizeof(Snapshot)) {
        return refuse(instance_of(c), "fmi2SerializeFMUstate got no state, or less room than its %u bytes",
                      (unsigned)sizeof(Snapshot));
    }
    Snapshot *snapshot = (Snapshot *)kept;
    snapshot->checksum = checksum(&snapshot->state);
    memcpy(bytes, snapshot, sizeof *snapshot);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component component, const fmi2Byte bytes[], size_t size, fmi2FMUstate *kept) {
    Instance *c = instance_of(component);
    Snapshot given;
    if (!c) return fmi2Error;
    if (!bytes || !kept) return refuse(c, "fmi2DeSerializeFMUstate got no bytes, or no place for the state");
    bool is_whole = size == sizeof given;
    if (is_whole) memcpy(&given, bytes, sizeof given);
    if (!is_whole || !is_ours(&given) || given.checksum != checksum(&given.state)) {
        return refuse(c, "the serialised state was changed, or is that of another FMU or another build");
    }
    Snapshot *snapshot = room_for(c, kept);
    if (!snapshot) return fmi2Error;
    *snapshot = given;
    return fmi2OK;
}
