//! What one drive of an arm turns: its own loop, inertia and dry friction, and the gravity of all links.
//!
//! The figures come from a file of numbers (`foreign_drives.py` writes it). The other joints are heard on the bus.

use std::f64::consts::TAU;

const LOOP_TIME: f64 = 0.001;
const STEPS_PER_LOOP: usize = 4;
/// rad that the gear gives before dry friction slips: 6 N·m on 10 000 N·m/rad.
const WINDS_UP: f64 = 0.0006;

type Vector = [f64; 3];

/// A link as its joint carries it: the joint's frame in that of the joint before, axis, mass and centre.
struct Link {
    rotation: [Vector; 3],
    place: Vector,
    axis: Vector,
    mass: f64,
    centre: Vector,
}

/// A drive: signed position units per rad of its output, its loop (P-PI, with feed-forward of the speed), gain in
/// N·m per unit of control signal, units of control signal per count, inertia and friction at the output.
struct Drive {
    units: f64,
    position_gain: f64,
    velocity_gain: f64,
    integral_gain: f64,
    feed_forward: f64,
    limit: f64,
    gain: f64,
    per_count: f64,
    inertia: f64,
    viscous: f64,
    coulomb: f64,
    start: f64,
}

pub struct Plant {
    own: usize,
    gravity: Vector,
    links: Vec<Link>,
    drives: Vec<Drive>,
    /// Joint positions from those of the drive outputs; its transpose makes drive torques of joint torques.
    to_joints: Vec<Vec<f64>>,
    outputs: Vec<f64>,
    speed: f64,
    wound: f64,
    before: f64,
    integral: f64,
    signal: f64,
    target: f64,
}

impl Plant {
    pub fn read(path: &str, node: u8) -> Plant {
        let text = std::fs::read_to_string(path).expect("the file of the plant");
        let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().expect("a number"));
        let mut next = move || numbers.next().expect("one more number");
        let n = next() as usize;
        let vector = |next: &mut dyn FnMut() -> f64| [next(), next(), next()];
        let gravity = vector(&mut next);
        let links = (0..n)
            .map(|_| Link {
                rotation: [vector(&mut next), vector(&mut next), vector(&mut next)],
                place: vector(&mut next),
                axis: vector(&mut next),
                mass: next(),
                centre: vector(&mut next),
            })
            .collect();
        let to_joints = (0..n).map(|_| (0..n).map(|_| next()).collect()).collect();
        let drives: Vec<Drive> = (0..n)
            .map(|_| Drive {
                units: next(),
                position_gain: next(),
                velocity_gain: next(),
                integral_gain: next(),
                feed_forward: next(),
                limit: next(),
                gain: next(),
                per_count: next(),
                inertia: next(),
                viscous: next(),
                coulomb: next(),
                start: next(),
            })
            .collect();
        let outputs: Vec<f64> = drives.iter().map(|drive| drive.start).collect();
        let own = usize::from(node) - 1;
        let (before, target) = (outputs[own], outputs[own]);
        Plant { own, gravity, links, drives, to_joints, outputs, speed: 0.0, wound: 0.0, before, integral: 0.0, signal: 0.0, target }
    }

    pub fn units_per_turn(&self) -> u32 {
        (self.drives[self.own].units.abs() * TAU).round() as u32
    }

    /// Another drive's TPDO: statusword, position.
    pub fn hear(&mut self, node: usize, data: &[u8]) {
        if node != self.own + 1 && (1..=self.drives.len()).contains(&node) && data.len() >= 6 {
            let units = i32::from_le_bytes([data[2], data[3], data[4], data[5]]);
            self.outputs[node - 1] = f64::from(units) / self.drives[node - 1].units;
        }
    }

    /// Where the drive says that it is, in its units.
    pub fn position(&self) -> f64 {
        self.outputs[self.own] * self.drives[self.own].units
    }

    /// Its control signal as 6077 counts it, in the sense in which its positions count.
    pub fn torque(&self) -> f64 {
        let drive = &self.drives[self.own];
        self.signal / drive.per_count * drive.units.signum()
    }

    /// The brake holds.
    pub fn hold(&mut self) {
        self.speed = 0.0;
        self.signal = 0.0;
        self.before = self.outputs[self.own];
        self.target = self.outputs[self.own];
        let drive = &self.drives[self.own];
        self.integral = self.load() / drive.gain / (drive.velocity_gain * drive.integral_gain);
    }

    /// One SYNC period towards a target in the drive's units.
    pub fn step(&mut self, target: f64, period: f64) {
        let load = self.load();
        let drive = &self.drives[self.own];
        let (from, to) = (self.target, target / drive.units);
        let (loops, slope) = ((period / LOOP_TIME).round().max(1.0), (to - from) / period);
        let mut output = self.outputs[self.own];
        for k in 1..=loops as usize {
            let wanted = from + (to - from) * k as f64 / loops;
            let measured = (output - self.before) / LOOP_TIME;
            self.before = output;
            let slip = drive.position_gain * (wanted - output) + drive.feed_forward * slope - measured;
            self.integral += slip * LOOP_TIME;
            let signal = drive.velocity_gain * (slip + drive.integral_gain * self.integral);
            self.signal = signal.clamp(-drive.limit, drive.limit);
            let time = LOOP_TIME / STEPS_PER_LOOP as f64;
            for _ in 0..STEPS_PER_LOOP {
                let friction = drive.coulomb * self.wound / WINDS_UP + drive.viscous * self.speed;
                self.speed += (drive.gain * self.signal - load - friction) / drive.inertia * time;
                output += self.speed * time;
                self.wound = (self.wound + self.speed * time).clamp(-WINDS_UP, WINDS_UP);
            }
        }
        self.outputs[self.own] = output;
        self.target = to;
    }

    /// N·m that hold the links where all joints are, at this drive's output.
    fn load(&self) -> f64 {
        let joints: Vec<f64> = self.to_joints.iter().map(|row| sum(row, &self.outputs)).collect();
        let (mut turned, mut place) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]);
        let (mut axes, mut places, mut centres) = (Vec::new(), Vec::new(), Vec::new());
        for (link, angle) in self.links.iter().zip(&joints) {
            place = add(place, apply(&turned, link.place));
            turned = product(&product(&turned, &link.rotation), &about(link.axis, *angle));
            axes.push(apply(&turned, link.axis));
            places.push(place);
            centres.push(add(place, apply(&turned, link.centre)));
        }
        let holding = (0..axes.len()).map(|k| {
            (k..axes.len())
                .map(|j| {
                    let arm: Vector = std::array::from_fn(|i| centres[j][i] - places[k][i]);
                    let weight: Vector = std::array::from_fn(|i| self.links[j].mass * self.gravity[i]);
                    -sum(&axes[k], &cross(arm, weight))
                })
                .sum::<f64>()
        });
        holding.enumerate().map(|(k, torque)| torque * self.to_joints[k][self.own]).sum()
    }
}

fn sum(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

fn cross(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn apply(m: &[Vector; 3], v: Vector) -> Vector {
    std::array::from_fn(|i| sum(&m[i], &v))
}

fn product(a: &[Vector; 3], b: &[Vector; 3]) -> [Vector; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Rodrigues' formula.
fn about(axis: Vector, angle: f64) -> [Vector; 3] {
    let (s, c) = angle.sin_cos();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let skew = match (j + 3 - i) % 3 {
                1 => -axis[3 - i - j],
                2 => axis[3 - i - j],
                _ => 0.0,
            };
            axis[i] * axis[j] * (1.0 - c) + skew * s + if i == j { c } else { 0.0 }
        })
    })
}
