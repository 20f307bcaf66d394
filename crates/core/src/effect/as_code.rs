//! What the effects of a model add to generated code: statements that C and Rust share, and what of them is
//! rather a property of links.
//!
//! The text is that of both languages but for four marks: `$f(` calls a function of the file, `state.x` is
//! what the model remembers, `let x = ..;` begins a constant, and `&state.x` hands a memory to a function.
//! Each law is that of the effect's own file, which a test compares along motions.

use super::empirical::cubes;
use super::law_text::{exact, law};
use super::{Added, AugmentedModel, CurveSignal, EffectError, Place, Role, entry};
use crate::robot::cft::geometry::L4;
use crate::robot::model::{JointFriction, Model};
use crate::robot::standard::{Body, STANDARD};
use crate::robot::{FormulaSignal, JointKind, Robot};

/// What a model remembers from sample to sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Memory {
    /// Name of the field.
    pub name: String,
    /// Numbers in it; one that is not in a list for `None`.
    pub size: Option<usize>,
    /// What it is at the begin, by the pose q.
    pub first: String,
    pub what: String,
}

/// Statements and numbers of all effects of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EffectsCode {
    /// After friction: what depends on a joint's own speed alone.
    pub friction: Vec<String>,
    /// After load and friction: other functions of q, v, a and load.
    pub added: Vec<String>,
    pub memory: Vec<Memory>,
    /// In a step, after all that remembers nothing.
    pub steps: Vec<String>,
    /// Joints whose memory takes its inertia from a pose, with the field.
    pub elastic: Vec<(usize, String)>,
    /// Standard parameters of bodies beside those of the model.
    pub extra: Option<Vec<[f64; STANDARD]>>,
    /// Gravity along the base's x and y that the model does not know, by the links \[m/s^2\].
    pub tilt: Option<[f64; 2]>,
    /// Gravity along x and y as statements for the pose alone, where it is no recursion's.
    pub askew: Vec<String>,
    /// Time by which the logged torque of each joint is late \[s\].
    pub lead_s: Vec<f64>,
    /// What is in the file, one line each.
    pub told: Vec<String>,
}

/// Length of a state of elasticity: the step, its four and four factors, the inertia, deflection and its rate,
/// the pull before, and whether it has begun.
const ELASTIC: usize = 14;
/// Where its inertia stands.
pub const INERTIA: usize = 9;

impl EffectsCode {
    /// Those of a model.
    ///
    /// # Errors
    /// [`EffectError::NoCode`].
    pub fn of(refined: &AugmentedModel) -> Result<Self, EffectError> {
        let mut out = EffectsCode {
            lead_s: vec![0.0; refined.model.robot.joints()],
            ..EffectsCode::default()
        };
        for (i, effect) in refined.effects.iter().enumerate() {
            out.add(i, effect, refined)?;
            out.told.push(effect.title(&refined.model.robot));
        }
        Ok(out)
    }

    fn add(
        &mut self,
        i: usize,
        effect: &Added,
        refined: &AugmentedModel,
    ) -> Result<(), EffectError> {
        let model = &refined.model;
        let robot = &model.robot;
        let unknown = || EffectError::NoCode {
            effect: effect.title(robot),
        };
        let (shape, c) = (&effect.shape, &effect.linear);
        let x = |k: usize| c.get(k).copied().map(exact).unwrap_or_default();
        let s = |k: usize| shape.get(k).copied().map(exact).unwrap_or_default();
        let on = effect.place.joint();
        let j = on.unwrap_or_default();
        // most sit at one joint
        let to = |what: String| format!("tau[{j}] += {what};");
        let (v, q) = (format!("v[{j}]"), format!("q[{j}]"));
        if let Some(formulas) = effect.law.formula {
            let signal = |signal: FormulaSignal, j: usize| {
                Some(match signal {
                    FormulaSignal::Position => format!("q[{j}]"),
                    FormulaSignal::Speed => format!("v[{j}]"),
                    FormulaSignal::Acceleration => format!("a[{j}]"),
                    FormulaSignal::Load => format!("load[{j}]"),
                    FormulaSignal::Direction => direction(refined, j, &format!("v[{j}]")),
                    FormulaSignal::Temperature => format!("temperature[{j}]"),
                    FormulaSignal::Time => "state.t".to_owned(),
                })
            };
            let text = formulas.code(j, (shape, c), &signal);
            let (text, timed) = text.ok_or_else(unknown)?;
            match timed {
                true => self.steps.push(to(text)),
                false => self.added.push(to(text)),
            }
            return Ok(());
        }
        match (effect.name(), effect.place) {
            ("delay", _) => {
                for (j, lead) in self.lead_s.iter_mut().enumerate() {
                    *lead += effect.shift(j);
                }
            }
            ("torque-offset", Place::Joint(_)) => self.added.push(to(x(0))),
            ("gravity-tilt", Place::All) => self.tilted([c[0], c[1]], model),
            ("gain", Place::Joint(_)) => {
                let own = law(&model.friction[j], &v);
                let offset = exact(model.offset[j]);
                self.added
                    .push(to(format!("{} * (load[{j}] + ({own} + {offset}))", x(0))));
            }
            ("asymmetric-friction", Place::Joint(_)) => self.friction.push(to(format!(
                "0.5 * (1.0 + {}) * ({} + {} * {v})",
                direction(refined, j, &v),
                x(0),
                x(1)
            ))),
            ("stribeck", Place::Joint(_)) => {
                let share = format!("({v} / {})", s(0));
                self.friction.push(to(format!(
                    "{} * ($sign({v}) * exp(-({share} * {share})))",
                    x(0)
                )));
            }
            ("smooth-coulomb", Place::Joint(_)) => self.friction.push(to(format!(
                "{} * (tanh({v} / {}) - $sign({v}))",
                x(0),
                s(0)
            ))),
            ("empirical", Place::Joint(_)) => {
                let (signal, friction) = match effect.curve() {
                    Some((CurveSignal::Position, _)) => (q, false),
                    Some((CurveSignal::Friction, _)) => (q, true),
                    Some((CurveSignal::Speed, _)) => (v.clone(), false),
                    Some((CurveSignal::Load, _)) => (format!("load[{j}]"), true),
                    // it would have to remember where the joint turned
                    Some((CurveSignal::Way, _)) | None => return Err(unknown()),
                };
                let curve = curve_text(effect, &signal);
                self.added.push(to(match friction {
                    true => format!("{} * ({curve})", direction(refined, j, &v)),
                    false => curve,
                }));
            }
            ("nonlinear-viscous", Place::Joint(_)) => self.friction.push(to(format!(
                "{} * ($sign({v}) * pow(fabs({v}), {}))",
                x(0),
                s(0)
            ))),
            ("load-friction", Place::Joint(_)) => self.added.push(to(format!(
                "({} + {} * fabs({v})) * (fabs(load[{j}]) * tanh({} * {v}))",
                x(0),
                x(1),
                s(0)
            ))),
            ("drive-efficiency", Place::Joint(_)) => self.added.push(to(format!(
                "{} * (load[{j}] * $positive(load[{j}] * {v}))",
                x(0)
            ))),
            ("actuator-friction", Place::Actuator(row)) => {
                self.of_screw(i, row, |speed, _| {
                    format!("{} * {speed} + {} * tanh({} * {speed})", x(0), x(1), s(0))
                });
            }
            ("rotor-inertia", Place::Joint(_)) => {
                self.added.push(to(format!("{} * a[{j}]", x(0))));
            }
            ("rotor-inertia", Place::Actuator(row)) => {
                self.of_screw(i, row, |_, acceleration| {
                    format!("{} * {acceleration}", x(0))
                });
            }
            ("rigid-body-terms", Place::All) => self.bodies(robot.dropped_links(c)),
            ("payload", Place::All) => match (shape.as_slice(), c.as_slice()) {
                (&[cx, cy, cz], &[mass, ball]) => {
                    self.bodies(robot.tool_links([mass, ball], [cx, cy, cz]));
                }
                (&[], &[mass, mx, my, mz, second]) => {
                    self.bodies(robot.level_tool_links([mass, mx, my, mz, second]));
                }
                _ => return Err(unknown()),
            },
            ("presliding", Place::Joint(_)) => {
                let field = self.remember(format!("bristle_{i}"), None, "0.0", &v, effect, robot);
                let ends = saturating(model, j, &v);
                let (own, next) = (format!("state.{field}"), format!("next_{i}"));
                self.steps.extend([
                    format!(
                        "let {next} = $sign({v}) + ({own} - $sign({v})) * exp(-{} * fabs({v}) * dt);",
                        s(0)
                    ),
                    to(format!(
                        "{} * (0.5 * ({own} + {next}) - {ends}) + {} * ({next} - {own}) / (dt * {})",
                        x(0),
                        x(1),
                        s(0)
                    )),
                    format!("{own} = {next};"),
                ]);
            }
            ("backlash", Place::Joint(_)) => {
                let field = self.remember(format!("far_{i}"), None, &q, &q, effect, robot);
                let (own, next) = (format!("state.{field}"), format!("far_side_{i}"));
                let half = exact(0.5 * shape[0]);
                self.steps.extend([
                    format!("let {next} = $within({own}, {q} - {half}, {q} + {half});"),
                    to(format!("{} * ($same({next}, {own}) * -$sign({v}))", x(0))),
                    format!("{own} = {next};"),
                ]);
            }
            ("elasticity", Place::Joint(_)) => {
                let name = format!("elastic_{i}");
                let field = self.remember(name, Some(ELASTIC), "0.0", &q, effect, robot);
                let rate = exact(std::f64::consts::TAU * shape[0]);
                self.steps.push(to(format!(
                    "{} * $elastic({rate}, {}, dt, load[{j}], &state.{field})",
                    x(0),
                    s(1)
                )));
                self.elastic.push((j, field));
            }
            ("ripple" | "position-friction", Place::Joint(_)) => {
                let wave = match robot.joint_kind(j) {
                    JointKind::Revolute => shape[0],
                    JointKind::Prismatic => std::f64::consts::TAU * shape[0],
                };
                let angle = format!("{} * {q}", exact(wave));
                let sum = format!("{} * sin({angle}) + {} * cos({angle})", x(0), x(1));
                self.added.push(to(match effect.name() {
                    "ripple" => sum,
                    _ => format!("{} * ({sum})", direction(refined, j, &v)),
                }));
            }
            ("spring", Place::Joint(_)) => {
                let way = format!("({q} - {})", s(0));
                self.added.push(to(format!(
                    "{} * {way} + {} * ({way} * {way} * {way})",
                    x(0),
                    x(1)
                )));
            }
            ("counterbalance", Place::Joint(_)) => {
                let width = exact((shape[1] - shape[0]).max(f64::MIN_POSITIVE));
                let own: Vec<String> = c.iter().copied().map(exact).collect();
                self.added.push(to(format!(
                    "$spline(({q} - {}) / {width}, {})",
                    s(0),
                    own.join(", ")
                )));
            }
            ("coupling", Place::Pair { on, of }) => {
                let turning = format!("$sign(v[{on}] + {} * v[{of}])", s(0));
                self.added.push(to(format!(
                    "{} * v[{of}] + {} * {turning} + {} * a[{of}]",
                    x(0),
                    x(1),
                    x(2)
                )));
            }
            ("coupling", Place::Geared { motor, other }) => {
                let (r, name) = (s(0), format!("shared_{i}"));
                self.added.extend([
                    format!("let {name} = {} * $sign(v[{motor}] + {r} * v[{other}]);", x(1)),
                    format!(
                        "tau[{motor}] += {} * ({r} * v[{other}]) + {name} + {} * ({r} * a[{other}]);",
                        x(0),
                        x(2)
                    ),
                    format!(
                        "tau[{other}] += {} * ({r} * v[{motor}]) + {r} * {name} + {} * ({r} * a[{motor}]);",
                        x(0),
                        x(2)
                    ),
                ]);
            }
            ("warm-up", Place::Joint(_)) => {
                let own = law(&model.friction[j], &v);
                self.steps.push(to(format!(
                    "{} * (({own}) * -expm1(-state.t / {}))",
                    x(0),
                    s(0)
                )));
            }
            ("drift", Place::Joint(_)) => self.steps.push(to(format!("{} * state.t", x(0)))),
            _ => return Err(unknown()),
        }
        Ok(())
    }

    /// A field of the state; its name.
    fn remember(
        &mut self,
        name: String,
        size: Option<usize>,
        first: &str,
        by: &str,
        effect: &Added,
        robot: &Robot,
    ) -> String {
        self.memory.push(Memory {
            name: name.clone(),
            size,
            first: first.to_owned(),
            what: format!("{}, by {by}", effect.title(robot)),
        });
        name
    }

    /// Bodies beside those of the model.
    fn bodies(&mut self, bodies: Vec<[f64; STANDARD]>) {
        match &mut self.extra {
            None => self.extra = Some(bodies),
            Some(all) => {
                for (sum, body) in all.iter_mut().zip(bodies) {
                    for (sum, x) in sum.iter_mut().zip(body) {
                        *sum += x;
                    }
                }
            }
        }
    }

    /// A base that stands askew: the recursion in another gravity, or the first moments of the closed form.
    fn tilted(&mut self, [gx, gy]: [f64; 2], model: &Model) {
        let Some(chain) = model.robot.coefficients(&model.theta) else {
            let [x, y] = self.tilt.unwrap_or_default();
            self.tilt = Some([x + gx, y + gy]);
            return;
        };
        let [a, b, c, e] = chain.h.map(exact);
        let (side, h0) = (exact(chain.o), exact(chain.h0));
        let [gx, gy, mass] = [gx, gy, -(chain.t1 + chain.mr)].map(exact);
        let along = format!("({gx} * sin(q[1]) - {gy} * cos(q[1]))");
        let across = format!("({gx} * cos(q[1]) + {gy} * sin(q[1]))");
        let by_psi = format!("({b} * cos(q[2] + q[3]) - {e} * sin(q[2] + q[3]))");
        self.askew.extend([
            format!("tau[0] += {mass} * {gy};"),
            format!(
                "tau[1] += {side} * {along} + ({h0} + {a} * sin(q[2]) + {b} * sin(q[2] + q[3]) + \
                 {c} * cos(q[2]) + {e} * cos(q[2] + q[3])) * {across};"
            ),
            format!("tau[2] += ({a} * cos(q[2]) - {c} * sin(q[2]) + {by_psi}) * {along};"),
            format!("tau[3] += {by_psi} * {along};"),
        ]);
    }

    /// Statements of a force in a screw of the CFT robot's pantograph, by its speed and acceleration:
    /// row `row` of d(x_r, y_r)/d(q4, q5) carries it to the joints.
    fn of_screw(&mut self, i: usize, row: usize, force: impl Fn(&str, &str) -> String) {
        let l = exact(L4);
        let (near, far) = (format!("near_{i}"), format!("far_{i}"));
        let (speed, pull) = (format!("speed_{i}"), format!("pull_{i}"));
        let w = "(v[2] + v[3])";
        let (of, rates) = match row {
            0 => ("cos", ["sin", ""]),
            _ => ("sin", ["cos", "-"]),
        };
        let [rate, sign] = rates;
        let turned = format!("{sign}{l} * {rate}(q[2] + q[3]) * {w}");
        self.added.extend([
            format!("let {far} = -{l} * {of}(q[2] + q[3]);"),
            format!("let {near} = {far} - {l} * {of}(q[2]);"),
        ]);
        let text = force(&speed, &pull);
        if text.contains(&speed) {
            self.added
                .push(format!("let {speed} = {near} * v[2] + {far} * v[3];"));
        }
        if text.contains(&pull) {
            self.added.push(format!(
                "let {pull} = {near} * a[2] + {far} * a[3] + ({turned} + {sign}{l} * {rate}(q[2]) * v[2]) * v[2] \
                 + {turned} * v[3];"
            ));
        }
        let name = format!("force_{i}");
        self.added.extend([
            format!("let {name} = {text};"),
            format!("tau[2] += {near} * {name};"),
            format!("tau[3] += {far} * {name};"),
        ]);
    }

    /// Whether anything is remembered or runs with time.
    pub fn remember_anything(&self) -> bool {
        !self.steps.is_empty()
    }
}

/// Saturating part of a joint's law over its height, -1..1.
fn saturating(model: &Model, j: usize, v: &str) -> String {
    match &model.friction[j] {
        JointFriction::None => "0.0".to_owned(),
        JointFriction::DoubleTanh(own) if (own.coulomb_1 + own.coulomb_2).abs() > 1e-12 => {
            let height = exact(own.coulomb_1 + own.coulomb_2);
            let all = law(&model.friction[j], v);
            format!("({all} - {} * {v}) / {height}", exact(own.viscous))
        }
        JointFriction::ViscousCoulomb(_) | JointFriction::DoubleTanh(_) => format!("$sign({v})"),
    }
}

/// An effect that is a property of links, drives or the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Property {
    /// Inertia of the drive of a joint \[kg or kg m^2\].
    Drive { joint: usize, inertia: f64 },
    /// Gravity along the base's x and y \[m/s^2\].
    Gravity([f64; 2]),
    /// A body on the last link, in its frame.
    Body(Body),
}

impl Added {
    /// The property that the effect is, where it is one that files of links can have.
    pub fn property(&self) -> Option<Property> {
        match (self.name(), self.place, &self.linear[..], &self.shape[..]) {
            ("rotor-inertia", Place::Joint(joint), &[inertia], _) => {
                Some(Property::Drive { joint, inertia })
            }
            ("gravity-tilt", _, &[gx, gy], _) => Some(Property::Gravity([gx, gy])),
            ("payload", _, &[mass, ball], &[x, y, z]) => Some(Property::Body(Body {
                mass,
                centre: [x, y, z],
                inertia: [ball, 0.0, 0.0, ball, 0.0, ball],
            })),
            _ => None,
        }
    }
}

/// Direction of a joint's friction at the speed `v`: that of its law, or of what was added to make it smooth.
fn direction(refined: &AugmentedModel, j: usize, v: &str) -> String {
    let smooth = |e: &&Added| e.law.direction.is_some() && e.place == Place::Joint(j);
    match refined.effects.iter().find(smooth) {
        Some(e) if refined.model.friction[j].jumps() => {
            format!("tanh({v} / {})", exact(e.shape[0]))
        }
        _ if refined.model.friction[j] == JointFriction::None => format!("$sign({v})"),
        _ => format!("({})", saturating(&refined.model, j, v)),
    }
}

/// The curve of an effect over a signal, as a sum of cubes that begin at its knots.
fn curve_text(effect: &Added, signal: &str) -> String {
    let above = |x: &str| format!("0.5 * (({x}) + fabs({x}))");
    let (from, to) = (effect.shape[1], effect.shape[2]);
    let cubes = cubes(&effect.linear);
    let (steps, terms) = cubes.split_at(2);
    let per_step = terms.len() as f64 / (to - from);
    let x = above(&format!(
        "({signal} - {}) * {}",
        exact(from),
        exact(per_step)
    ));
    let beyond = above(&format!("{x} - {}", exact(terms.len() as f64)));
    let x = format!("({x} - {beyond})");
    let mut out = format!("{} + {} * {x}", exact(steps[0]), exact(steps[1]));
    for (k, cube) in terms.iter().enumerate() {
        let part = above(&format!("{x} - {}", exact(k as f64)));
        out += &format!(" + {} * pow({part}, 3.0)", exact(*cube));
    }
    out
}

/// Why an effect of this name is no torque that a controller could send; `None` where it is one.
pub fn no_torque(name: &str) -> Option<&'static str> {
    let entry = entry(name)?;
    (entry.role == Role::Fault).then_some(match name {
        "disturbance" => "it is an episode of one log, and no law tells when the next one comes",
        "saturation" => "it is the end of the range of a torque channel",
        "quantisation" => "it is the grain of a logged channel",
        "stuck-channel" => "it is a channel that repeated its last value",
        "wrong-sign-or-order" => "it is a channel that was logged with another sign or place",
        "filter" => "it is a lag of a logged channel",
        _ => "it is a fault of a log",
    })
}
