//! Integration of an axis with effects in it, and beside it the effort that the same axis without them would have needed
//! for the motion that its sensor shows.
//!
//! Time goes in substeps of at most 20 us. Each drifts the position by half, kicks the velocity with every torque at the
//! middle (bristles by [`Friction::bristle`]), and drifts by the other half: second order, and a spring keeps its
//! energy. An effort value is the mean over a sample. The effort gap of a sample is that mean less inertia times the
//! mean acceleration and the mean friction of the axis without effects, along the sensed motion before noise and
//! rounding.

use crate::axis::Axis;
use crate::control::Loop;
use crate::draw::Draw;
use crate::experiment::Experiment;
use crate::form::{Body, Form, Now};
use crate::friction::{Friction, Law, Level};
use crate::noise::{EffortNoise, second_derivative};

/// Longest substep, s.
pub(crate) const FINE_S: f64 = 2e-5;

/// What one log's run leaves.
pub(crate) struct Run {
    pub(crate) time_s: Vec<f64>,
    /// With noise.
    pub(crate) effort: Vec<f64>,
    /// As the counter gives it.
    pub(crate) position: Vec<f64>,
    /// Effort that the axis without effects does not explain, without noise.
    pub(crate) gap: Vec<f64>,
    /// Noise in terms of effort: of the effort itself, and inertia times what noise and rounding of the position do to
    /// its second derivative.
    pub(crate) noise: Vec<f64>,
    /// Mean acceleration, mean dry friction and mean velocity a sample, of the axis without effects.
    pub(crate) regressors: Vec<[f64; 3]>,
    /// True velocity at each sample.
    pub(crate) velocity: Vec<f64>,
}

/// Friction of the axis without effects, along the sensed motion.
struct Shadow {
    friction: Friction,
    rest_speed: f64,
    z: f64,
}

impl Shadow {
    /// Dry friction over a substep at sensed velocity `v`, where `free` is the torque that the rest of the model leaves
    /// for friction.
    fn dry(&mut self, v: f64, h: f64, free: f64) -> f64 {
        let level = self.friction.level(v, &Level::default());
        if self.friction.law == Law::Static {
            // At rest static friction is whatever holds; a log cannot tell slower motion from rest.
            let held = free.clamp(-level, level);
            let share = (v.abs() / self.rest_speed).min(1.0);
            return share * level * v.signum() + (1.0 - share) * held;
        }
        let next = self.friction.bristle(self.z, v, h, level);
        let torque = self.friction.torque(self.z, next, h);
        self.z = next;
        torque
    }
}

/// Motion of the axis and what moves with it.
#[derive(Default)]
struct State {
    q: f64,
    v: f64,
    z: f64,
    load_q: f64,
    load_v: f64,
    drive: f64,
    friction: f64,
    rest_s: f64,
}

/// Runs an experiment; `None` if the motion leaves all bounds.
pub(crate) fn run(
    axis: &Axis,
    forms: &mut [Box<dyn Form>],
    experiment: &Experiment,
    substep_s: f64,
    draw: &mut Draw,
) -> Option<Run> {
    let samples = experiment.torque.len();
    let step = 1.0 / axis.rate_hz;
    let n = (step / substep_s).ceil() as usize;
    let h = step / n as f64;
    let mut body = Body {
        friction: axis.friction,
        coupling: None,
    };
    for form in forms.iter_mut() {
        form.reset(axis);
        form.configure(&mut body);
    }
    let mut shadow = Shadow {
        friction: axis.friction,
        rest_speed: axis.rest_speed(),
        z: 0.0,
    };
    let mut noise = EffortNoise::new(
        axis.effort_noise.0,
        axis.effort_noise.1,
        axis.effort_noise.2,
        step,
        draw,
    );
    let mut control = Loop::default();
    let mut state = State::default();
    let kept = libm::exp(-h / axis.current_loop_s);
    let mut command = 0.0;
    let mut sensed_offset = 0.0;
    let mut last_v: Option<f64> = None;
    let mut counting = Vec::with_capacity(samples);
    let mut sampled = Vec::with_capacity(samples);
    let mut run = Run {
        time_s: Vec::with_capacity(samples),
        effort: Vec::with_capacity(samples),
        position: Vec::with_capacity(samples),
        gap: Vec::with_capacity(samples),
        noise: Vec::with_capacity(samples),
        regressors: Vec::with_capacity(samples),
        velocity: Vec::with_capacity(samples),
    };
    for k in 0..samples {
        let time = k as f64 * step;
        let now = Now {
            t: time,
            h,
            q: state.q,
            v: state.v,
            u: state.drive,
            friction: state.friction,
            rest_s: state.rest_s,
        };
        let sensed = state.q + sensed_offset;
        let late = axis.jitter_s * draw.normal();
        let mut reading = sensed;
        for form in forms.iter_mut() {
            reading = form.sample(&now, reading);
        }
        sampled.push(reading - sensed);
        let seen = reading + state.v * late + axis.count * axis.count_noise * draw.normal();
        let position = (seen / axis.count).round() * axis.count;
        counting.push(position - reading);
        run.time_s.push(time);
        run.position.push(position);
        run.velocity.push(state.v);
        let torque = experiment.torque[k]
            + experiment.gains.map_or(0.0, |gains| {
                control.torque(
                    &gains,
                    experiment.target[k],
                    position,
                    step,
                    axis.torque_limit,
                )
            });
        // What was computed at the sample before acts now.
        let acting = std::mem::replace(
            &mut command,
            torque.clamp(-axis.torque_limit, axis.torque_limit),
        );

        let mut sums = [0.0; 3];
        let start_v = last_v.unwrap_or(state.v);
        let mut effort = 0.0;
        let mut end_v = start_v;
        for i in 0..n {
            let drive_next = acting + (state.drive - acting) * kept;
            let u = 0.5 * (state.drive + drive_next);
            state.drive = drive_next;
            let v_before = state.v;
            let now = substep(
                &mut state,
                &body,
                forms,
                axis,
                u,
                time + (i as f64 + 0.5) * h,
                h,
            );
            let mut offset = 0.0;
            for form in forms.iter_mut() {
                form.advance(&now);
                offset += form.offset(&Now {
                    q: state.q,
                    v: state.v,
                    ..now
                });
            }
            let drift = (offset - sensed_offset) / h;
            sensed_offset = offset;
            let v_sensed = 0.5 * (v_before + state.v) + drift;
            let v_end = state.v + drift;
            let a_sensed = (v_end - end_v) / h;
            end_v = v_end;
            let viscous = axis.friction.viscous * v_sensed;
            let dry = shadow.dry(v_sensed, h, u - axis.inertia * a_sensed - viscous);
            effort += u;
            sums[1] += dry;
            sums[2] += v_sensed;
        }
        if !state.q.is_finite() || state.v.abs() > 30.0 * axis.rated_speed {
            return None;
        }
        last_v = Some(end_v);
        let a = (end_v - start_v) / step;
        let [_, dry, v] = sums.map(|sum| sum / n as f64);
        let effort = effort / n as f64;
        let error = noise.next(draw);
        run.effort.push(effort + error);
        run.noise.push(error);
        run.gap
            .push(effort - axis.inertia * a - dry - axis.friction.viscous * v);
        run.regressors.push([a, dry, v]);
    }
    for (noise, second) in run.noise.iter_mut().zip(second_derivative(&counting, step)) {
        *noise -= axis.inertia * second;
    }
    for (gap, second) in run.gap.iter_mut().zip(second_derivative(&sampled, step)) {
        *gap -= axis.inertia * second;
    }
    Some(run)
}

/// One substep; returns what the effects saw of it.
fn substep(
    state: &mut State,
    body: &Body,
    forms: &mut [Box<dyn Form>],
    axis: &Axis,
    u: f64,
    time: f64,
    h: f64,
) -> Now {
    let middle = state.q + 0.5 * h * state.v;
    let now = Now {
        t: time,
        h,
        q: middle,
        v: state.v,
        u,
        friction: state.friction,
        rest_s: state.rest_s,
    };
    let mut torque = forms
        .iter_mut()
        .fold(u, |torque, form| form.actuator(&now, torque));
    let mut level = Level::default();
    let (mut factor, mut slope) = (1.0, 0.0);
    for form in forms.iter() {
        torque += form.torque(&now);
        form.level(&now, &mut level);
        let (form_factor, form_slope) = form.inertia(&now);
        factor *= form_factor;
        slope += form_slope;
    }
    let mut inertia = axis.inertia * factor;
    torque -= 0.5 * axis.inertia * slope * state.v * state.v;
    if let Some(coupling) = &body.coupling {
        let load_middle = state.load_q + 0.5 * h * state.load_v;
        let between = (coupling.torque)(middle - load_middle, state.v - state.load_v);
        let load_inertia = inertia * coupling.load_share;
        inertia -= load_inertia;
        torque -= between;
        state.load_v += h * between / load_inertia;
        state.load_q = load_middle + 0.5 * h * state.load_v;
    }
    let friction = &body.friction;
    let viscous = level.viscous * friction.viscous;
    let friction_v = forms
        .iter()
        .fold(state.v, |v, form| form.friction_velocity(v));
    if friction.law == Law::Static {
        let hold = friction.level(0.0, &level);
        let slides =
            |direction: f64| friction.level(friction_v, &level) * direction + viscous * friction_v;
        if state.v == 0.0 && torque.abs() <= hold {
            state.friction = torque;
        } else {
            let direction = if state.v == 0.0 {
                torque.signum()
            } else {
                state.v.signum()
            };
            state.friction = if state.v == 0.0 {
                hold * direction
            } else {
                slides(direction)
            };
            state.v += h * (torque - state.friction) / inertia;
            if state.v * direction < 0.0 {
                state.v = 0.0;
            }
        }
    } else {
        let guess = state.friction + viscous * friction_v;
        let v_middle = state.v + 0.5 * h * (torque - guess) / inertia;
        let g = friction.level(friction_v + v_middle - state.v, &level);
        let z = friction.bristle(state.z, v_middle, h, g);
        state.friction = friction.torque(state.z, z, h);
        state.z = z;
        state.v +=
            h * (torque - state.friction - viscous * (friction_v + v_middle - state.v)) / inertia;
    }
    state.q = middle + 0.5 * h * state.v;
    state.rest_s = if state.v.abs() < axis.rest_speed() {
        state.rest_s + h
    } else {
        0.0
    };
    now
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Target;
    use crate::form::Now;
    use std::f64::consts::TAU;

    fn axis(coulomb: f64, viscous: f64) -> Axis {
        Axis {
            linear: false,
            inertia: 2e-4,
            friction: Friction {
                law: Law::Static,
                coulomb,
                stiction: coulomb,
                stribeck_velocity: 1.0,
                stiffness: 20.0,
                damping: 0.01,
                viscous,
                breakaway_ratio: 0.7,
            },
            rated_speed: 100.0,
            travel: 10.0,
            torque_limit: 1.0,
            count: 1e-6,
            rate_hz: 1000.0,
            effort_noise: (0.0, 0.5, 0.01),
            count_noise: 0.0,
            jitter_s: 0.0,
            current_loop_s: 1e-9,
        }
    }

    fn torque(torque: Vec<f64>) -> Experiment {
        Experiment {
            name: "test",
            target: vec![Target::default(); torque.len()],
            torque,
            gains: None,
        }
    }

    fn play(axis: &Axis, forms: &mut [Box<dyn Form>], experiment: &Experiment) -> Run {
        run(axis, forms, experiment, FINE_S, &mut Draw::new(1, 0)).unwrap()
    }

    #[test]
    fn runs_up_against_friction_as_in_closed_form_and_stops_for_good() {
        let axis = axis(0.05, 1e-3);
        let mut drive = vec![0.1; 500];
        drive.extend([0.0; 700]);
        let run = play(&axis, &mut [], &torque(drive));
        // A torque acts a sample after it was computed.
        let t = 499.0 * 1e-3;
        let exact = (0.1 - 0.05) / 1e-3 * (1.0 - libm::exp(-1e-3 / 2e-4 * t));
        // Dry friction is explicit: half a substep of the fall, 5/s times 1e-5 s.
        assert!(
            (run.velocity[500] / exact - 1.0).abs() < 5e-5,
            "{}",
            run.velocity[500]
        );
        assert_eq!(run.velocity[1199], 0.0);
    }

    /// A spring on the rotor, for its frequency and its energy.
    struct Tied(f64);

    impl Form for Tied {
        fn torque(&self, now: &Now) -> f64 {
            -self.0 * now.q
        }
    }

    #[test]
    fn a_spring_swings_at_its_frequency_and_keeps_its_energy() {
        let axis = axis(1e-12, 0.0);
        let frequency_hz = 40.0;
        let stiffness = axis.inertia * (TAU * frequency_hz) * (TAU * frequency_hz);
        let mut kick = vec![0.0; 10_001];
        kick[0] = 0.1;
        let run = play(&axis, &mut [Box::new(Tied(stiffness))], &torque(kick));
        let energy = |k: usize| {
            0.5 * axis.inertia * run.velocity[k] * run.velocity[k]
                + 0.5 * stiffness * run.position[k] * run.position[k]
        };
        // 400 swings; the position is rounded to 1e-6 of an amplitude of 2e-3 rad.
        assert!((energy(10_000) / energy(10) - 1.0).abs() < 2e-3);
        let crossings = run
            .velocity
            .windows(2)
            .filter(|w| w[0] <= 0.0 && w[1] > 0.0)
            .count();
        assert!((399..=401).contains(&crossings), "{crossings}");
    }

    /// The gap of an added torque is that torque, whatever moves: here a sine in time on a closed loop's worth of motion.
    #[test]
    fn the_gap_is_what_an_effect_adds() {
        struct Hum;
        impl Form for Hum {
            fn torque(&self, now: &Now) -> f64 {
                -0.01 * libm::sin(TAU * 3.0 * now.t)
            }
        }
        let mut axis = axis(0.05, 1e-3);
        axis.friction.law = Law::ElastoPlastic;
        let drive = (0..3000)
            .map(|k| 0.12 * libm::sin(f64::from(k) * 0.01))
            .collect();
        let drive = torque(drive);
        let clean = play(&axis, &mut [], &drive);
        let worst = clean
            .gap
            .iter()
            .fold(0.0, |worst: f64, gap| worst.max(gap.abs()));
        // A thousandth of F_C: the shadow moves its bristles at the end of a substep's velocity, the axis at a guess of it.
        assert!(worst < 5e-5, "{worst:e}");
        let hum = play(&axis, &mut [Box::new(Hum)], &drive);
        for k in 0..3000 {
            let t = (k as f64 + 0.5) * 1e-3;
            assert!(
                (hum.gap[k] - 0.01 * libm::sin(TAU * 3.0 * t)).abs() < 1e-4,
                "{k}: {}",
                hum.gap[k]
            );
        }
    }

    #[test]
    fn a_second_inertia_resonates_where_it_should() {
        struct Split(f64);
        impl Form for Split {
            fn configure(&self, body: &mut Body) {
                let stiffness = self.0;
                body.coupling = Some(crate::form::Coupling {
                    load_share: 0.5,
                    torque: Box::new(move |x, _| stiffness * x),
                });
            }
        }
        let axis = axis(1e-12, 0.0);
        let reduced = axis.inertia * 0.25;
        let stiffness = reduced * (TAU * 50.0) * (TAU * 50.0);
        let mut kick = vec![0.0; 2000];
        kick[0] = 0.1;
        let run = play(&axis, &mut [Box::new(Split(stiffness))], &torque(kick));
        // The motor swings about the speed that the kick gave the whole.
        let mean = 0.1 * 1e-3 / axis.inertia;
        let crossings = run
            .velocity
            .windows(2)
            .filter(|w| w[0] <= mean && w[1] > mean)
            .count();
        assert!((98..=101).contains(&crossings), "{crossings}");
    }
}
