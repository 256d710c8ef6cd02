"""One whole run: sample, control, record, move, tick after tick (model.md section 2)."""

from __future__ import annotations

import math

import numpy as np

from nonlinear._kernels import layout
from nonlinear._kernels.compiled import kernel
from nonlinear._kernels.control import clamp, measured_angle, measured_speed, note_limits, pi
from nonlinear._kernels.probes import memory_size, probe
from nonlinear._kernels.record import collect, record, record_probes
from nonlinear._kernels.reduce import clear, extremes, step_figures, window
from nonlinear._kernels.segment import DECAY, LENGTH, RINGING, SMOOTH, segment, slip_step
from nonlinear._kernels.signals import signal
from nonlinear._kernels.smooth import tanh_segment

FINITE = 1e15
PROBE_U = layout.PROBES + layout.POINT_VOLTAGE * layout.PROBE_SIZE
PROBE_I = layout.PROBES + layout.POINT_CURRENT * layout.PROBE_SIZE
PROBE_W = layout.PROBES + layout.POINT_SPEED * layout.PROBE_SIZE
PROBE_Y = layout.PROBES + layout.POINT_OUTPUT * layout.PROBE_SIZE


@kernel
def run(p, c, table, tables, history, flag_history, out, shared):  # type: ignore[no-untyped-def]
    """Run the drive described by the row ``p``; returns a status number of ``layout``.

    ``c`` holds the constants of `segment.prepare`, ``table`` those of `smooth.prepare_tanh`; with ``None``
    for it the tanh law is not even compiled.
    ``history`` is (columns, rows) or empty; ``flag_history`` (rows,); ``out`` a row of results;
    ``shared[0]`` is set to the ticks done from time to time, a non-zero ``shared[1]`` stops the run.
    """
    clear(out)
    ticks, Ts = int(p[layout.TICKS]), p[layout.PERIOD]
    n_v, n_p = int(p[layout.EVERY_VELOCITY]), int(p[layout.EVERY_POSITION])
    T_v, T_p = n_v * Ts, n_p * Ts
    N, kM, Kg = p[layout.RATIO], p[layout.TORQUE_CONSTANT], p[layout.SOURCE_GAIN]
    has_velocity, has_current = p[layout.HAS_VELOCITY] > 0.0, p[layout.HAS_CURRENT] > 0.0
    Kv, kff = p[layout.POSITION_GAIN], p[layout.FEEDFORWARD]
    Kp_v, Ki_v = p[layout.VELOCITY_GAIN], p[layout.VELOCITY_INTEGRAL]
    Kp_c, Ki_c = p[layout.CURRENT_GAIN], p[layout.CURRENT_INTEGRAL]
    w_max, dw_max = p[layout.SPEED_LIMIT], p[layout.ACCELERATION_LIMIT] * T_p
    i_max, u_max = p[layout.CURRENT_LIMIT], p[layout.VOLTAGE_LIMIT]
    back = p[layout.BACK_DRIVABLE] / N
    offset, CM = p[layout.OFFSET], p[layout.LOAD_COEFFICIENT]
    load_slope = p[layout.LOAD_SLOPE] / N
    load_length, torque_length = int(p[layout.LOAD_TABLE_LENGTH]), int(p[layout.TORQUE_TABLE_LENGTH])
    probe_u, probe_i = p[PROBE_U] > 0.0, p[PROBE_I] > 0.0
    probe_w, probe_y = p[PROBE_W] > 0.0, p[PROBE_Y] > 0.0
    probing = probe_u or probe_i or probe_w or probe_y
    every, rows = int(p[layout.RECORD_EVERY]), flag_history.shape[0]
    recording = rows > 0
    length, cycles = int(p[layout.WINDOW]), p[layout.CYCLES]
    harmonics, with_extremes = int(p[layout.HARMONICS]), p[layout.WITH_EXTREMES] > 0.0
    target, band = p[layout.STEP_TARGET], p[layout.STEP_BAND]
    reducing = length > 0 or with_extremes
    biased = p[layout.BIAS] > 0.0

    smooth, ringing, split = c[SMOOTH] > 0.0, c[RINGING] > 0.0, c[LENGTH] > 0.0
    # a segment is looked at closely where energies are asked for or w' may turn twice
    close = ringing or p[layout.WITH_ENERGY] > 0.0
    Cv_p, Cv_m = p[layout.VISCOUS], p[layout.VISCOUS_REVERSE]
    dry = CM * abs(p[layout.LOAD])
    Tcp, Tcm, Tb = p[layout.DRY] + dry, p[layout.DRY_REVERSE] + dry, back * p[layout.LOAD] - offset
    varying = load_slope != 0.0 or load_length > 0 or torque_length > 0
    breakaway = p[layout.BREAKAWAY]
    locked_gain = 0.0 if p[layout.SOURCE] > 0.0 else 1.0 / p[layout.RESISTANCE]

    i, w, th = p[layout.CURRENT_START], p[layout.SPEED_START], p[layout.ANGLE_START]
    th_start = th
    s = 1.0 if smooth or w > 0.0 else (-1.0 if w < 0.0 else 0.0)
    if table is not None:  # the smoothed law knows no rest
        s = 1.0
    I_c, I_v = p[layout.CURRENT_INTEGRATOR_START], p[layout.VELOCITY_INTEGRATOR_START]
    w_lim = p[layout.SPEED_COMMAND_START]
    w_ref, i_ref, u = w_lim, p[layout.CURRENT_COMMAND_START], p[layout.VOLTAGE_START]
    queue_size = int(p[layout.DELAY_TICKS]) + 2
    queue = np.full(queue_size, u)
    m = int(p[layout.DIFFERENCE_SAMPLES])
    angles = np.empty(m)
    for j in range(m):
        angles[j] = measured_angle(p, th - (m - j) * T_v * w)
    filtered, angle_place = w, 0
    memory = np.zeros((4, memory_size(p) if probing else 1))
    position = np.zeros(4, np.int64)
    if probe_y:
        memory[layout.POINT_OUTPUT, :] = th / N
    memory[layout.POINT_SPEED, :] = w_ref
    memory[layout.POINT_CURRENT, :] = i_ref
    memory[layout.POINT_VOLTAGE, :] = u
    sig = np.zeros(layout.ALL_SIGNALS)
    u_pre, i_pre, w_pre, y_pre, y_post = u, i_ref, w_ref, th / N, th / N

    th_ref_last = th
    ref = 0.0
    cp, cv, place = 0, 0, 0
    since_record, row = 0, 0
    flag_w, flag_a, flag_i, flag_u = 0, 0, 0, 0
    ph_c, ph_s, cos_step, sin_step = 1.0, 0.0, 1.0, 0.0
    if length > 0:
        cos_step = math.cos(2.0 * math.pi * cycles / length)
        sin_step = math.sin(2.0 * math.pi * cycles / length)
    into_window, which = -(ticks - 2 * length), 1
    y_last = 0.0
    total_events, max_events, stick_ticks = 0, 0, 0
    acting_w, acting_a, acting_i, acting_u, seen = 0, 0, 0, 0, 0
    status, k = layout.OK, 0

    while k < ticks:
        # -- everything sampled at t_k --------------------------------------------------------------
        sampled = cp == 0 or recording or reducing
        if sampled:
            ref = signal(p, layout.COMMAND, tables, k, Ts)
            if biased:
                ref += signal(p, layout.BIAS, tables, k, Ts)
        if cp == 0:
            cp = n_p
            y = th
            if probe_y:
                y_pre = th / N
                y_post = probe(p, layout.POINT_OUTPUT, tables, k, Ts, y_pre, memory, position)
                y = N * y_post
            th_ref = N * ref
            v = Kv * (th_ref - y) + kff * (th_ref - th_ref_last) / T_p
            th_ref_last = th_ref
            if has_velocity:
                target_w = clamp(v, w_max)
                flag_w = 0 if target_w == v else layout.FLAG_SPEED
                change = target_w - w_lim
                allowed = clamp(change, dw_max)
                flag_a = 0 if allowed == change else layout.FLAG_ACCELERATION
                w_lim = target_w if allowed == change else w_lim + allowed
                w_pre = w_ref = w_lim
                if probe_w:
                    w_ref = clamp(probe(p, layout.POINT_SPEED, tables, k, Ts, w_pre, memory, position), w_max)
            elif has_current:
                i_pre = i_ref = clamp(v, i_max)
                flag_i = 0 if i_ref == v else layout.FLAG_CURRENT
            else:
                u_pre = u = clamp(v, u_max)
                flag_u = 0 if u == v else layout.FLAG_VOLTAGE
            fresh = True
        else:
            fresh = False
        cp -= 1
        if has_velocity:
            if cv == 0:
                cv = n_v
                filtered = measured_speed(p, th, w, angles, angle_place, filtered, T_v)
                angle_place = angle_place + 1 if angle_place + 1 < m else 0
                limit = i_max if has_current else u_max
                v, I_v, hit = pi(w_ref - filtered, I_v, Kp_v, Ki_v, limit)
                fresh = True
                if has_current:
                    i_pre = i_ref = v
                    flag_i = layout.FLAG_CURRENT if hit else 0
                else:
                    u_pre = u = v
                    flag_u = layout.FLAG_VOLTAGE if hit else 0
            else:
                fresh = False
            cv -= 1
        if probe_i and fresh:
            i_ref = clamp(probe(p, layout.POINT_CURRENT, tables, k, Ts, i_pre, memory, position), i_max)
        if has_current:
            u, I_c, hit = pi(i_ref - i, I_c, Kp_c, Ki_c, u_max)
            u_pre = u
            flag_u = layout.FLAG_VOLTAGE if hit else 0
            fresh = True
        if probe_u and fresh:
            u = clamp(probe(p, layout.POINT_VOLTAGE, tables, k, Ts, u_pre, memory, position), u_max)

        # -- what is kept ---------------------------------------------------------------------------
        flags = flag_w | flag_a | flag_i | flag_u
        if flags:
            acting_w, acting_a = acting_w + (flag_w > 0), acting_a + (flag_a > 0)
            acting_i, acting_u = acting_i + (flag_i > 0), acting_u + (flag_u > 0)
            if (flags & ~seen) != 0 or k >= ticks - length:
                note_limits(flags, flags & ~seen, k, k >= ticks - length, out)
                seen |= flags
        if s == 0.0:
            stick_ticks += 1
            if k >= ticks - length:
                out[layout.OUT_WINDOW_STICK] += 1.0
            flags |= layout.FLAG_STICK
        if recording:
            if since_record == 0 and row >= 0:  # the second spares the compiler its checks
                since_record = every
                record(history, flag_history, row, flags, ref, th / N, w, i, u, i_ref, w_ref, th)
                if probing:
                    record_probes(p, history, row, u_pre, u, i_pre, i_ref, w_pre, w_ref, y_pre, y_post)
                row += 1
            since_record -= 1
        if target != 0.0:
            y = (th - th_start) / (N * target)
            step_figures(y, y_last, k, band, out)
            y_last = y
        if reducing:
            if with_extremes or into_window >= 0:
                collect(sig, ref, th / N, w, i, u, i_ref, w_ref, u_pre, i_pre, w_pre, y_pre, y_post)
                count = layout.ALL_SIGNALS if probing else layout.BASE_SIGNALS
                if with_extremes:
                    extremes(sig, count, out)
                if length > 0 and into_window >= 0:
                    if into_window == length:
                        into_window, which = 0, 0
                    if into_window == 0:
                        ph_c, ph_s = 1.0, 0.0
                    window(sig, count, which, harmonics, ph_c, ph_s, out)
                    ph_c, ph_s = ph_c * cos_step - ph_s * sin_step, ph_c * sin_step + ph_s * cos_step
            into_window += 1

        # -- motion from t_k to t_(k+1) -------------------------------------------------------------
        queue[place] = u
        # the queue holds u_k and the q + 1 before it; the oldest is the next place
        place = place + 1 if place + 1 < queue_size else 0
        u_first = queue[place]
        next_place = place + 1 if place + 1 < queue_size else 0
        u_second = queue[next_place]
        if varying:
            M = p[layout.LOAD] + load_slope * th
            if load_length > 0:
                M += tables[int(p[layout.LOAD_TABLE]) + min(k, load_length - 1)]
            dry = CM * abs(M)
            Tcp, Tcm = p[layout.DRY] + dry, p[layout.DRY_REVERSE] + dry
            Tb = back * M - offset
            if torque_length > 0:
                Tb += tables[int(p[layout.TORQUE_TABLE]) + min(k, torque_length - 1)]
        events = 0
        for part in range(0 if split else 1, 2):
            held = u_first if part == 0 else u_second
            if table is not None:
                i, w, th = tanh_segment(p, c, table, part, held, Tb, Tcp, Tcm, i, w, th, out)
                continue
            if not close:
                if s != 0.0:
                    reverse = s < 0.0
                    T = Tb - s * (Tcm if reverse else Tcp)
                    o = (24 if reverse else 0) + 12 * part
                    i1, w1, th1 = slip_step(c, o, i, w, th, held, T)
                    if smooth:
                        i, w, th = i1, w1, th1
                        continue
                    Cv = Cv_m if reverse else Cv_p
                    drive = Kg * held + T
                    a0 = s * (kM * i + drive - Cv * w)
                    a1 = s * (kM * i1 + drive - Cv * w1)
                    if s * w > 0.0 and s * w1 > 0.0 and not (a0 < 0.0 and a1 > 0.0):
                        i, w, th = i1, w1, th1
                        continue
                else:
                    final = held * locked_gain
                    i1 = final + (i - final) * c[DECAY + part]
                    d0, d1 = kM * i + Kg * held + Tb, kM * i1 + Kg * held + Tb
                    up, down = Tcp * breakaway, -Tcm * breakaway
                    if down <= d0 <= up and down <= d1 <= up:
                        i = i1
                        continue
            i, w, th, s, happened, status = segment(p, c, part, held, Tb, Tcp, Tcm, i, w, th, s, out)
            events += happened
            if status != layout.OK:
                break
        if events:
            total_events += events
            max_events = max(max_events, events)
        k += 1
        if status != layout.OK:
            break
        if not (abs(w) < FINITE):  # the other states pass through w
            status = layout.NOT_FINITE
            break
        if (k & 0xFFFF) == 0:
            shared[0] = k
            if shared[1] != 0.0:
                status = layout.CANCELLED
                break

    limit = layout.OUT_LIMIT_TICKS
    out[limit], out[limit + 1], out[limit + 2], out[limit + 3] = acting_w, acting_a, acting_i, acting_u
    shared[0] = k
    out[layout.OUT_TICKS], out[layout.OUT_EVENTS] = k, total_events
    out[layout.OUT_MAX_EVENTS], out[layout.OUT_STICK_TICKS] = max_events, stick_ticks
    out[layout.OUT_CURRENT], out[layout.OUT_SPEED], out[layout.OUT_ANGLE] = i, w, th
    out[layout.OUT_CURRENT_INTEGRATOR], out[layout.OUT_VELOCITY_INTEGRATOR] = I_c, I_v
    out[layout.OUT_SPEED_COMMAND], out[layout.OUT_CURRENT_COMMAND] = w_lim, i_ref
    out[layout.OUT_VOLTAGE] = u
    return status
