//! What the keys do.

use super::{Plots, Scope, WINDOWS_S};
use bristle_core::command::Command;
use bristle_core::experiment::Bounds;
use bristle_core::experiment::fields::in_single_precision;
use bristle_gap::plan::Step;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// A press of + or - changes the window by this factor.
const ZOOM: f64 = 1.5;
/// A press of an arrow moves a picture that stands by this part of its window.
const SCROLL: f64 = 0.1;
/// A press of a bracket moves the level by this part of the axis's Coulomb friction, or speed.
const LEVEL: f64 = 0.1;

impl Scope {
    pub(super) fn event(&mut self, event: &Event) {
        if let Event::Key(key) = event
            && key.kind == KeyEventKind::Press
        {
            self.key(key);
        }
    }

    fn key(&mut self, key: &KeyEvent) {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        if control && key.code == KeyCode::Char('c') {
            self.quits = true;
            return;
        }
        if self.panel.open && self.panel_key(key.code) {
            return;
        }
        match key.code {
            KeyCode::Char('q') => self.quits = true,
            KeyCode::Char(' ') => {
                let [_, end_s] = self.window();
                self.paused_s = self.paused_s.is_none().then_some(end_s);
            }
            KeyCode::Char('+' | '=') => self.zoom(1.0 / ZOOM),
            KeyCode::Char('-') => self.zoom(ZOOM),
            KeyCode::Left => self.scroll(-SCROLL),
            KeyCode::Right => self.scroll(SCROLL),
            KeyCode::Tab => {
                self.plots = match self.plots {
                    Plots::All => Plots::DeflectionOverVelocity,
                    Plots::DeflectionOverVelocity => Plots::FrictionOverVelocity,
                    Plots::FrictionOverVelocity => Plots::FrictionOverPosition,
                    Plots::FrictionOverPosition => Plots::All,
                }
            }
            KeyCode::Char('t') => {
                let next = self.trigger.on.next();
                self.trigger.set(next);
            }
            KeyCode::Char('[') => self.level(-LEVEL),
            KeyCode::Char(']') => self.level(LEVEL),
            KeyCode::Char('a') => {
                self.armed = true;
                self.order("arm", Command::Arm);
            }
            KeyCode::Char('d') => self.order("disarm", Command::Disarm),
            KeyCode::Char('x') => self.order("stop", Command::Stop),
            KeyCode::Char('c') => self.order("clear", Command::ClearFault),
            KeyCode::Char('e') => self.experiment += 1,
            KeyCode::Char('s') => self.start(),
            KeyCode::Char('r') => self.record(),
            KeyCode::Char('p') => self.panel.open = true,
            _ => {}
        }
    }

    /// Whether the panel took the key.
    fn panel_key(&mut self, key: KeyCode) -> bool {
        match key {
            KeyCode::Up => self.panel.choose(false),
            KeyCode::Down => self.panel.choose(true),
            KeyCode::Backspace => {
                self.panel.typed.pop();
            }
            KeyCode::Esc | KeyCode::Char('p') => {
                self.panel.open = false;
                self.panel.typed.clear();
            }
            KeyCode::Enter => match self.panel.enter() {
                Some((name, orders)) => {
                    for order in orders {
                        self.order(name, order);
                    }
                }
                None => self.say("type a number first", true),
            },
            KeyCode::Char(key) => return self.panel.key(key),
            _ => return false,
        }
        true
    }

    fn zoom(&mut self, factor: f64) {
        self.window_s = (self.window_s * factor).clamp(WINDOWS_S[0], WINDOWS_S[1]);
    }

    /// Moves a picture that stands, within what is kept.
    fn scroll(&mut self, part: f64) {
        let (Some(first), Some(last)) = (self.buffer.first(), self.buffer.last()) else {
            return;
        };
        let [_, end_s] = self.window();
        let end_s = end_s + part * self.window_s;
        self.paused_s = Some(end_s.clamp(first.time_s.min(last.time_s), last.time_s));
    }

    fn level(&mut self, part: f64) {
        let scale = match self.trigger.on {
            super::trigger::On::Torque => self.axis.coulomb_nm,
            _ => self.axis.stribeck_velocity_rad_s,
        };
        self.trigger.level += part * scale;
    }

    /// The chosen experiment, sized for the axis, for its usual time.
    fn start(&mut self) {
        let step = Step::new(self.experiment(), &self.axis);
        let bounds = Bounds {
            travel_rad: step.bounds.travel_rad as f32,
            speed_rad_s: step.bounds.speed_rad_s as f32,
            torque_nm: step.bounds.torque_nm as f32,
            ticks: step.bounds.ticks,
        };
        let experiment = in_single_precision(&step.experiment);
        self.order(step.name(), Command::Play(experiment, bounds));
    }
}
