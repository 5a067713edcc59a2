/* The equations of motion of many members by Dormand and Prince's method of order 8 with equal
 * steps of the drive's angle: what `runge_kutta.py` does with arrays, a few members at a time.
 *
 * Source: Hairer, Norsett, Wanner 1993, Solving Ordinary Differential Equations I, section II.10.
 */

#include <math.h>
#include <stdlib.h>

#define LANES 4 /* what a register holds */
#define STAGES 12

typedef double lanes __attribute__((vector_size(8 * LANES)));

typedef struct {
    int size, terms, tangents, pairs, triples, driven;
    long members;
    const int *pair, *triple, *row, *column, *place, *massless;
    const double *weight, *force, *parametric, *rate, *drive; /* drive: of each stage of a period */
    const double *a, *b, *third, *fifth;
    double step, small, escaped;
} equations;

typedef struct {
    lanes *z, *dz, *pair, *dpair, *product, *force, *parametric, *stage, *state, *trial, rate;
} place;

static lanes *room(long n) {
    void *found = NULL;
    if (posix_memalign(&found, 64, (size_t)(n > 0 ? n : 1) * sizeof(lanes))) return NULL;
    return found;
}

static lanes every(double value) {
    lanes found;
    for (int i = 0; i < LANES; i++) found[i] = value;
    return found;
}

static lanes larger(lanes a, lanes b) {
    for (int l = 0; l < LANES; l++) {
        double size = fabs(b[l]);
        a[l] = size > a[l] ? size : a[l];
    }
    return a;
}

/* minus the force of all monomials on each mode, from their products, into the rates */
static void forces(const equations *e, const lanes *product, lanes *to) {
    for (int r = 0; r < e->size; r++) {
        lanes some[4] = {every(0.0), every(0.0), every(0.0), every(0.0)}; /* none waits for one */
        int n = e->row[r], last = e->row[r + 1];
        for (; n + 3 < last; n += 4)
            for (int k = 0; k < 4; k++) some[k] += e->weight[n + k] * product[e->column[n + k]];
        for (; n < last; n++) some[0] += e->weight[n] * product[e->column[n]];
        to[r] = -(some[0] + some[1] + some[2] + some[3]);
    }
}

static void driven(const equations *e, const place *p, const double *drive, const lanes *q,
                   lanes *to) {
    for (int n = 0; n < e->driven; n++) {
        lanes sum = every(0.0);
        for (int t = 0; t < e->terms; t++) sum += drive[t] * p->parametric[n * e->terms + t];
        to[e->place[2 * n]] += sum * q[e->place[2 * n + 1]];
    }
}

static void finish(const equations *e, const place *p, const lanes *v, lanes *to) {
    int size = e->size;
    for (int r = 0; r < size; r++) {
        lanes force = to[size + r];
        to[r] = p->rate * (e->massless[r] ? force : v[r]);
        to[size + r] = e->massless[r] ? every(0.0) : p->rate * force;
    }
}

/* rates of a state and of its tangents, one after the other */
static void rates(const equations *e, place *p, const double *drive, const lanes *y, lanes *to) {
    int size = e->size, n2 = 2 * size;
    for (int i = 0; i < n2; i++) p->z[i] = y[i];
    p->z[n2] = every(1.0);
    for (int n = 0; n < e->pairs; n++) p->pair[n] = p->z[e->pair[2 * n]] * p->z[e->pair[2 * n + 1]];
    for (int n = 0; n < e->triples; n++)
        p->product[n] = p->pair[e->triple[2 * n]] * p->z[e->triple[2 * n + 1]];
    forces(e, p->product, to + size);
    for (int r = 0; r < size; r++)
        for (int t = 0; t < e->terms; t++) to[size + r] += drive[t] * p->force[r * e->terms + t];
    driven(e, p, drive, y, to + size);
    finish(e, p, y + size, to);
    for (int k = 1; k <= e->tangents; k++) {
        const lanes *d = y + k * n2;
        lanes *into = to + k * n2;
        for (int i = 0; i < n2; i++) p->dz[i] = d[i];
        p->dz[n2] = every(0.0);
        for (int n = 0; n < e->pairs; n++) {
            int a = e->pair[2 * n], b = e->pair[2 * n + 1];
            p->dpair[n] = p->dz[a] * p->z[b] + p->z[a] * p->dz[b];
        }
        for (int n = 0; n < e->triples; n++) {
            int a = e->triple[2 * n], b = e->triple[2 * n + 1];
            p->product[n] = p->dpair[a] * p->z[b] + p->pair[a] * p->dz[b];
        }
        forces(e, p->product, into + size);
        driven(e, p, drive, d, into + size);
        finish(e, p, d + size, into);
    }
}

/* one step; the relative error estimated of the states is added to `error` as its maximum */
static void step(const equations *e, place *p, const double *drive, int all, double *error) {
    int n2 = 2 * e->size;
    for (int s = 0; s < STAGES; s++) {
        double h[STAGES];
        int used[STAGES], count = 0;
        for (int k = 0; k < s; k++)
            if (e->a[s * STAGES + k] != 0.0) {
                h[count] = e->step * e->a[s * STAGES + k];
                used[count++] = k * all;
            }
        for (int i = 0; i < all; i++) {
            lanes sum = p->state[i];
            for (int k = 0; k < count; k++) sum += h[k] * p->stage[used[k] + i];
            p->trial[i] = sum;
        }
        rates(e, p, drive + s * e->terms, p->trial, p->stage + s * all);
    }
    lanes large = every(0.0), low = large, high = large, nought = large;
    for (int i = 0; i < all; i++) {
        lanes more = every(0.0), third = every(0.0), fifth = every(0.0);
        for (int s = 0; s < STAGES; s++) {
            more += e->b[s] * p->stage[s * all + i];
            if (i < n2) {
                third += e->third[s] * p->stage[s * all + i];
                fifth += e->fifth[s] * p->stage[s * all + i];
            }
        }
        p->state[i] += e->step * more;
        if (i >= n2) continue;
        large = larger(large, p->state[i]);
        nought += 0.0 * p->state[i]; /* unless it is no number */
        low = larger(low, third);
        high = larger(high, fifth);
    }
    for (int l = 0; l < LANES; l++) {
        double below = sqrt(high[l] * high[l] + 0.01 * low[l] * low[l]);
        double own = below > 0 ? e->step * high[l] * high[l] / below : 0.0;
        own /= fmax(large[l], e->small);
        if (!(large[l] < e->escaped && nought[l] == 0.0)) own = INFINITY;
        error[l] = fmax(error[l], own);
    }
}

/* States (tangents + 1, 2 size, members) of the members first ... last - 1 over `samples` times
 * `between` steps; samples of the states alone go to `out` (samples, 2 size, members). 0 if all
 * went well. */
int advance(const equations *e, double *y, long first, long last, long per_period, long samples,
            long between, double *out, double *error) {
    int n2 = 2 * e->size, all = n2 * (e->tangents + 1), terms = e->terms;
    place p = {room(n2 + 1),  room(n2 + 1),  room(e->pairs),           room(e->pairs),
               room(e->triples), room(e->size * terms), room(e->driven * terms),
               room((long)STAGES * all), room(all),    room(all), every(0.0)};
    int failed = !(p.z && p.dz && p.pair && p.dpair && p.product && p.force && p.parametric &&
                   p.stage && p.state && p.trial);
    for (long b = first; b < last && !failed; b += LANES) {
        double worst[LANES] = {0.0};
        long at[LANES];
        for (int l = 0; l < LANES; l++) {
            at[l] = b + l < last ? b + l : b;
            p.rate[l] = e->rate[at[l]];
            for (int i = 0; i < all; i++) p.state[i][l] = y[i * e->members + at[l]];
            for (int i = 0; i < e->size * terms; i++)
                p.force[i][l] = e->force[i * e->members + at[l]];
            for (int i = 0; i < e->driven * terms; i++)
                p.parametric[i][l] = e->parametric[i * e->members + at[l]];
        }
        long count = 0;
        int lost = 0;
        for (long n = 0; n < samples; n++) {
            for (long k = 0; k < between && !lost; k++, count++)
                step(e, &p, e->drive + (count % per_period) * STAGES * terms, all, worst);
            lost = 1;
            for (int l = 0; l < LANES; l++) lost = lost && isinf(worst[l]);
            for (int i = 0; i < n2; i++)
                for (int l = 0; l < LANES && b + l < last; l++)
                    out[(n * n2 + i) * e->members + b + l] = p.state[i][l];
        }
        for (int l = 0; l < LANES && b + l < last; l++) {
            error[b + l] = worst[l];
            for (int i = 0; i < all; i++) y[i * e->members + b + l] = p.state[i][l];
        }
    }
    void *rooms[] = {p.z, p.dz, p.pair, p.dpair, p.product, p.force, p.parametric,
                     p.stage, p.state, p.trial};
    for (int i = 0; i < 10; i++) free(rooms[i]);
    return failed;
}
