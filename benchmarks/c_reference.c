/* The simulator's algorithm in C, for the speed comparison: sampled cascade, exact slip between events,
 * stick and breakaway in closed form, limits with conditional integration, histories of eight columns.
 *
 * What the baseline needs: coulomb friction, self-locking load, real eigenvalues, any computing delay.
 * Transition coefficients arrive in `k`, in the order of nonlinear/_kernels/layout.py:
 * slip(direction, part) 12 numbers each: a11 a12 a21 a22 a31 a32 b1 b2 b3 c1 c2 c3.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

typedef struct {
    double Ts, R, L, kE, kM, J, N, Cv, C0, CM, breakaway;
    double Kv, Kp_v, Ki_v, Kp_c, Ki_c, w_max, a_max, i_max, u_max;
    double load, amplitude, frequency, fraction;
    int64_t ticks, n_v, n_p, q;
} drive_t;

typedef struct { double i, w, th, s; int events; } state_t;

static inline double clamp(double x, double limit) { return fmin(fmax(x, -limit), limit); }

static inline double pi_step(double e, double *I, double Kp, double Ki, double limit, int *hit)
{
    double updated = *I + Ki * e, v = Kp * e + updated, out = clamp(v, limit);
    *hit = out != v;
    if (out == v || (v > 0 && e < 0) || (v < 0 && e > 0)) { *I = updated; return out; }
    return clamp(Kp * e + *I, limit);
}

static inline void slip_step(const double *m, double i, double w, double th, double u, double T,
                             double *i1, double *w1, double *th1)
{
    *i1 = m[0] * i + m[1] * w + m[6] * u + m[9] * T;
    *w1 = m[2] * i + m[3] * w + m[7] * u + m[10] * T;
    *th1 = th + (m[4] * i + m[5] * w + m[8] * u + m[11] * T);
}

static void phi12(double x, double *first, double *second)
{
    if (fabs(x) < 0.5) {
        double total = 0.5, term = 0.5;
        for (int j = 3; j < 18; j++) { term *= x / j; total += term; }
        *first = 1 + x * total; *second = total;
        return;
    }
    *first = expm1(x) / x;
    *second = (*first - 1) / x;
}

/* state after slipping for t; real distinct eigenvalues */
static void slip_at(const drive_t *d, double t, double *i, double *w, double *th, double u, double T)
{
    double a11 = -d->R / d->L, a12 = -d->kE / d->L, a21 = d->kM / d->J, a22 = -d->Cv / d->J;
    double m = 0.5 * (a11 + a22), h = 0.5 * (a11 - a22), s = sqrt(h * h + a12 * a21);
    double di = a11 * *i + a12 * *w + u / d->L, dw = a21 * *i + a22 * *w + T / d->J;
    double qi = (a11 - m) * di + a12 * dw, qw = a21 * di + (a22 - m) * dw, e1, f1, e2, f2;
    phi12((m + s) * t, &e1, &f1);
    phi12((m - s) * t, &e2, &f2);
    double scale = t / (2 * s);
    double a = 0.5 * t * (e1 + e2), b = scale * (e1 - e2);
    double a2 = 0.5 * t * t * (f1 + f2), b2 = t * scale * (f1 - f2);
    *th += *w * t + a2 * dw + b2 * qw;
    *i += a * di + b * qi;
    *w += a * dw + b * qw;
}

static double speed_at(const drive_t *d, double t, double i, double w, double u, double T, double *i_t)
{
    double th = 0;
    slip_at(d, t, &i, &w, &th, u, T);
    *i_t = i;
    return w;
}

/* first landing in (0, dt]; -1 none, -2 never left */
static double first_landing(const drive_t *d, double s, double i, double w, double u, double T, double dt)
{
    double a11 = -d->R / d->L, a12 = -d->kE / d->L, a21 = d->kM / d->J, a22 = -d->Cv / d->J;
    double m = 0.5 * (a11 + a22), h = 0.5 * (a11 - a22), r = sqrt(h * h + a12 * a21);
    double di = a11 * i + a12 * w + u / d->L, dw = a21 * i + a22 * w + T / d->J;
    double q = a21 * di + (a22 - m) * dw, extremum = INFINITY, i_t;
    if (q != 0 && fabs(r * dw / q) < 1) {
        double t = atanh(-r * dw / q) / r;
        if (t > 0) extremum = t;
    }
    int up = s * w > 0;
    double begin = 0, end = fmin(extremum, dt);
    for (;;) {
        double w_end = speed_at(d, end, i, w, u, T, &i_t);
        if (s * w_end > 0) up = 1;
        else if (up) break;
        if (end >= dt) return up ? -1 : -2;
        begin = end;
        end = dt;
    }
    double low = begin, high = end, t = 0.5 * (low + high);
    for (int n = 0; n < 200; n++) {
        double w_t = speed_at(d, t, i, w, u, T, &i_t);
        if (s * w_t > 0) low = t; else high = t;
        if (w_t == 0) return t;
        double slope = a21 * i_t + a22 * w_t + T / d->J, next = slope != 0 ? t - w_t / slope : t;
        if (!(low < next && next < high)) next = 0.5 * (low + high);
        if (fabs(next - t) <= 2.3e-16 * end || high - low <= 2.3e-16 * end) return next;
        t = next;
    }
    return t;
}

static state_t segment(const drive_t *d, const double *k, int part, double dt, double u, double Tc, state_t x)
{
    double left = dt, Tp = Tc * d->breakaway, final = u / d->R;
    while (left > 0 && x.events < 1000) {
        if (x.s == 0) {
            double drive = d->kM * x.i;
            if (fabs(drive) > Tp) { x.s = copysign(1, drive); x.events++; continue; }
            double i_end = final + (x.i - final) * exp(-d->R / d->L * left), end = d->kM * i_end;
            if (fabs(end) <= Tp) { x.i = i_end; break; }
            double level = copysign(Tp, end) / d->kM, ratio = (x.i - final) / (level - final);
            left -= fmin(ratio > 1 ? d->L / d->R * log(ratio) : 0, left);
            x.i = level; x.s = copysign(1, end); x.events++;
            continue;
        }
        double T = -x.s * Tc, t = first_landing(d, x.s, x.i, x.w, u, T, left), span = t < 0 ? left : t;
        if (t < 0 && left == dt)
            slip_step(k + 12 * ((x.s < 0 ? 2 : 0) + part), x.i, x.w, x.th, u, T, &x.i, &x.w, &x.th);
        else
            slip_at(d, span, &x.i, &x.w, &x.th, u, T);
        left -= span;
        if (t == -2) { x.w = 0; x.s = 0; }
        else if (t >= 0) {
            x.w = 0;
            x.s = -x.s * d->kM * x.i > Tp ? -x.s : 0;
            x.events++;
        }
    }
    return x;
}

/* returns the number of events; history is eight columns of d->ticks rows */
int64_t simulate(const drive_t *d, const double *k, double *history, uint8_t *flag_history)
{
    const int64_t n = d->ticks, size = d->q + 2;
    const double T_p = d->n_p * d->Ts, dw_max = d->a_max * T_p, omega = 2 * M_PI * d->frequency;
    const double Tc = d->C0 + d->CM * fabs(d->load), Tp = Tc * d->breakaway;
    const double decay[2] = {exp(-d->R / d->L * d->fraction), exp(-d->R / d->L * (d->Ts - d->fraction))};
    const double length[2] = {d->fraction, d->Ts - d->fraction};
    double *queue = calloc(size, sizeof(double));
    double I_v = 0, I_c = 0, w_ref = 0, i_ref = 0;
    state_t x = {0, 0, 0, 0, 0};
    int64_t place = 0, events = 0, cp = 0, cv = 0;
    int flag_w = 0, flag_a = 0, flag_i = 0;
    for (int64_t j = 0; j < n; j++) {
        double ref = d->amplitude * sin(omega * (j * d->Ts));
        if (cp == 0) {
            cp = d->n_p;
            double v = d->Kv * (d->N * ref - x.th), target = clamp(v, d->w_max), change = target - w_ref;
            double allowed = clamp(change, dw_max);
            flag_w = target != v; flag_a = allowed != change ? 2 : 0;
            w_ref = allowed == change ? target : w_ref + allowed;
        }
        cp--;
        if (cv == 0) {
            cv = d->n_v;
            int hit;
            i_ref = pi_step(w_ref - x.w, &I_v, d->Kp_v, d->Ki_v, d->i_max, &hit);
            flag_i = hit ? 4 : 0;
        }
        cv--;
        int hit;
        double u = pi_step(i_ref - x.i, &I_c, d->Kp_c, d->Ki_c, d->u_max, &hit);
        history[j] = ref; history[n + j] = x.th / d->N; history[2 * n + j] = x.w;
        history[3 * n + j] = x.i; history[4 * n + j] = u; history[5 * n + j] = i_ref;
        history[6 * n + j] = w_ref; history[7 * n + j] = x.th;
        flag_history[j] = flag_w | flag_a | flag_i | (hit ? 8 : 0) | (x.s == 0 ? 16 : 0);
        queue[place] = u;
        place = place + 1 < size ? place + 1 : 0;
        double held[2] = {queue[place], queue[place + 1 < size ? place + 1 : 0]};
        for (int part = d->fraction > 0 ? 0 : 1; part < 2; part++) {
            double T = -x.s * Tc, i1, w1, th1;
            if (x.s != 0) {
                slip_step(k + 12 * ((x.s < 0 ? 2 : 0) + part), x.i, x.w, x.th, held[part], T, &i1, &w1, &th1);
                double a0 = x.s * (d->kM * x.i + T - d->Cv * x.w), a1 = x.s * (d->kM * i1 + T - d->Cv * w1);
                if (x.s * x.w > 0 && x.s * w1 > 0 && !(a0 < 0 && a1 > 0)) {
                    x.i = i1; x.w = w1; x.th = th1;
                    continue;
                }
            } else {
                double final = held[part] / d->R;
                i1 = final + (x.i - final) * decay[part];
                if (fabs(d->kM * x.i) <= Tp && fabs(d->kM * i1) <= Tp) { x.i = i1; continue; }
            }
            x.events = 0;
            x = segment(d, k, part, length[part], held[part], Tc, x);
            events += x.events;
        }
    }
    free(queue);
    return events;
}
