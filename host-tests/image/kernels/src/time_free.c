/* The time-free observer as one would write it in C, for comparison: the same law as core/src/observer/time_free.rs. */

#include <math.h>
#include <stdint.h>

#define SEGMENTS 64

struct time_free {
    float level_nm[SEGMENTS + 1];
    float segments_per_rad_s;
    float compliance_rad_nm;
    float breakaway_ratio;
    float per_mixed_range;
    float z_max_rad;
    float rad_per_count;
    float largest_step_rad;
    /* State. */
    float z_rad;
    uint32_t rejected;
};

/* Filled by kernel_setup. */
struct time_free time_free_in_c;

/* Not fminf and fmaxf, which are calls on this processor: their rule for NaN has no instruction. */
static float least(float a, float b)
{
    return b < a ? b : a;
}

static float most(float a, float b)
{
    return b > a ? b : a;
}

static float level_nm(const struct time_free *c, float speed)
{
    float x = least(speed * c->segments_per_rad_s, (float)SEGMENTS);
    int i = (int)x;
    if (i > SEGMENTS - 1)
        i = SEGMENTS - 1;
    float low = c->level_nm[i];
    return low + (c->level_nm[i + 1] - low) * (x - (float)i);
}

static float half_sine(float x)
{
    float u = least(most(x, 0.0f), 1.0f) - 0.5f;
    float s = u * u;
    float q = -0.0034975833952219744f;
    q = q * s + 0.04013954067605746f;
    q = q * s - 0.28958843695696157f;
    q = q * s + 1.2026842508886666f;
    q = q * s - 2.283185306424339f;
    return 0.5f + u * (1.0f + (s - 0.25f) * q);
}

/* A function of its own, as the one in Rust is. */
__attribute__((noinline)) static float step(struct time_free *c, int32_t counts, float velocity)
{
    float dq = (float)counts * c->rad_per_count;
    float z = c->z_rad;
    if (!(isfinite(velocity) && fabsf(dq) <= c->largest_step_rad)) {
        if (c->rejected != UINT32_MAX)
            c->rejected++;
        return z;
    }
    if (counts == 0)
        return z;
    float z_ss = level_nm(c, fabsf(velocity)) * c->compliance_rad_nm;
    float along = copysignf(z, z * dq);
    float next;
    if (along <= c->breakaway_ratio * z_ss) {
        next = z + dq;
    } else if (along >= z_ss) {
        next = copysignf(z_ss, z);
    } else {
        float share = along / z_ss;
        float alpha = half_sine((share - c->breakaway_ratio) * c->per_mixed_range);
        next = z + dq * (1.0f - alpha * share);
    }
    if (next > c->z_max_rad)
        next = c->z_max_rad;
    else if (next < -c->z_max_rad)
        next = -c->z_max_rad;
    c->z_rad = next;
    return next;
}

uint32_t kernel_time_free_c(uint32_t counts, uint32_t velocity)
{
    union { uint32_t bits; float value; } in = {velocity}, out;
    out.value = step(&time_free_in_c, (int32_t)counts, in.value);
    return out.bits;
}
