// The discrete time-free observer in C, written for comparison with core/src/observer/time_free.rs: the same law, the
// same checks, the same order of operations, so that z is the same bit for bit. The emulator fills `parameters` and
// calls the functions at the end.

#include <stdbool.h>
#include <stdint.h>

#define SEGMENTS 64

/// A Stribeck curve sampled at even steps of speed.
struct table {
    /// The last segment is flat, and holds every higher speed.
    float level_nm[SEGMENTS + 2];
    float segments_per_rad_s;
};

/// The observer: the elasto-plastic model, the angle of a count and the longest step an axis can make in a sample.
struct time_free {
    struct table curve;
    float compliance_rad_nm;
    float breakaway_ratio;
    float per_mixed_range;
    float z_max_rad;
    float rad_per_count;
    float largest_step_rad;
};

/// Deflection, and how many samples were rejected.
struct state {
    float z_rad;
    uint32_t rejected;
};

static float within(float x, float limit) {
    if (__builtin_expect(__builtin_fabsf(x) > limit, 0)) {
        return __builtin_copysignf(limit, x);
    }
    return x;
}

/// Level at a speed, N m.
static float level_nm(const struct table *table, float speed_rad_s) {
    float x = speed_rad_s * table->segments_per_rad_s;
    uint32_t i = (uint32_t)x;
    if (i > SEGMENTS) {
        i = SEGMENTS;
    }
    float low = table->level_nm[i];
    float high = table->level_nm[i + 1];
    return low + (high - low) * (x - (float)(int32_t)i);
}

/// (1 + sin(pi (x - 1/2)))/2 for x from 0 to 1.
static float half_sine(float x) {
    float u = x - 0.5f;
    float s = u * u;
    float q = 0.03856046234606336f;
    q = q * s + -0.2893574259628464f;
    q = q * s + 1.2026721831131366f;
    q = q * s + -2.283185144364166f;
    return 0.5f + u * (1.0f + (s - 0.25f) * q);
}

/// Takes the step in counts since the last sample and a filtered velocity, and gives z at this sample, rad.
static float step(const struct time_free *observer, struct state *state, int32_t step_counts, float velocity_rad_s) {
    float dq = (float)step_counts * observer->rad_per_count;
    bool believed = __builtin_isfinite(velocity_rad_s) && __builtin_fabsf(dq) <= observer->largest_step_rad;
    if (__builtin_expect(!believed, 0)) {
        if (state->rejected != UINT32_MAX) {
            state->rejected++;
        }
        return state->z_rad;
    }
    float z = state->z_rad;
    if (step_counts == 0) {
        return z;
    }
    float z_ss = level_nm(&observer->curve, __builtin_fabsf(velocity_rad_s)) * observer->compliance_rad_nm;
    float along = step_counts < 0 ? -z : z;
    float next;
    if (along <= observer->breakaway_ratio * z_ss) {
        next = z + dq;
    } else if (along >= z_ss) {
        next = __builtin_copysignf(z_ss, z);
    } else {
        float share = along / z_ss;
        float alpha = half_sine((share - observer->breakaway_ratio) * observer->per_mixed_range);
        next = z + dq * (1.0f - alpha * share);
    }
    state->z_rad = within(next, observer->z_max_rad);
    return state->z_rad;
}

struct time_free parameters;
static struct state state;

/// At rest.
uint32_t kernel_setup(void) {
    state = (struct state){0};
    return 1;
}

/// Step in counts, velocity; numbers travel as their bits in core registers.
uint32_t kernel_time_free(uint32_t step_counts, uint32_t velocity) {
    float velocity_rad_s;
    __builtin_memcpy(&velocity_rad_s, &velocity, sizeof velocity);
    float z_rad = step(&parameters, &state, (int32_t)step_counts, velocity_rad_s);
    uint32_t bits;
    __builtin_memcpy(&bits, &z_rad, sizeof bits);
    return bits;
}

/// Top of the memory, and an entry that nobody takes: the emulator calls the functions above.
__attribute__((section(".vectors"), used)) static const uint32_t vectors[2] = {0x20018000, 0};
