//! One axis of an arm as a node on the crate zencan-node: `foreign_slave INTERFACE NODE [PLANT]`.
//!
//! The crate speaks NMT, SDO and PDO; here are the power states of CiA 402, the watch over the master (1016) and EMCY. An
//! RPDO acts with the next SYNC. The axis follows its target with a lag, or, with the file of a plant, by its own loop
//! against inertia, friction and the gravity of the whole arm.

mod plant;

use std::time::{Duration, Instant};

use socketcan::{CanFilter, CanFrame, CanSocket, EmbeddedFrame, Id, Socket, SocketOptions, StandardId};
use zencan_node::common::messages::{CanId, CanMessage};
use zencan_node::common::NodeId;
use zencan_node::{Callbacks, Node};

use plant::Plant;

#[allow(dead_code)]
mod od {
    zencan_node::include_modules!(DRIVE);
}

const SYNC: u32 = 0x080;
const TPDO_1: u32 = 0x180;
const HEARTBEAT: u32 = 0x700;
const HEARTBEAT_LOST: u16 = 0x8130;
const FOLLOWING_ERROR: u16 = 0x8611;
const FUNCTION: u32 = 0x780;
const NODE: u32 = 0x07F;
/// Share of the distance to the target that is covered in a SYNC period.
const FOLLOWS: f64 = 0.5;

#[derive(Clone, Copy, PartialEq)]
enum State {
    Disabled,
    Ready,
    SwitchedOn,
    Enabled,
    Fault,
}

struct Axis {
    state: State,
    position: f64,
    speed: f64,
    target: f64,
    reset_was: bool,
    watch: Option<Instant>,
    plant: Option<Plant>,
}

impl Axis {
    fn obey(&mut self) {
        let word = od::OBJECT6040.get_value();
        let reset = word & 0x80 != 0;
        self.state = match (self.state, word & 0x0F) {
            (State::Fault, _) if reset && !self.reset_was => {
                od::OBJECT603F.set_value(0);
                State::Disabled
            }
            (State::Fault, _) => State::Fault,
            (_, low) if low & 0x02 == 0 => State::Disabled,
            (State::Enabled, low) if low & 0x04 == 0 => State::Disabled,
            (State::Disabled, 0x06) => State::Ready,
            (State::Disabled, _) => State::Disabled,
            (State::Ready, 0x07) | (State::Enabled, 0x07) => State::SwitchedOn,
            (State::SwitchedOn, 0x0F) => State::Enabled,
            (_, 0x06) => State::Ready,
            (same, _) => same,
        };
        self.reset_was = reset;
        if self.state != State::Enabled {
            self.target = self.position;
        }
    }

    /// A SYNC: the axis moves towards the target that it knows, and takes the next one.
    fn sync(&mut self) -> Option<u16> {
        let torque = self.go();
        self.obey();
        if self.state == State::Enabled {
            self.target = f64::from(od::OBJECT607A.get_value());
        }
        od::OBJECT6064.set_value(self.position.round() as i32);
        od::OBJECT6077.set_value(torque as i16);
        self.show();
        let off = (self.target - self.position).abs();
        (self.state == State::Enabled && off > f64::from(od::OBJECT6065.get_value())).then_some(FOLLOWING_ERROR)
    }

    /// Moves for one period; the torque that it took.
    fn go(&mut self) -> f64 {
        if let Some(plant) = &mut self.plant {
            if self.state == State::Enabled {
                plant.step(self.target, period());
            } else {
                plant.hold();
            }
            self.position = plant.position();
            return plant.torque();
        }
        let before = self.position;
        if self.state == State::Enabled {
            self.position += FOLLOWS * (self.target - self.position);
        }
        let speed = self.position - before;
        let torque = (0.2 * speed + 0.5 * (speed - self.speed)).clamp(-1000.0, 1000.0);
        self.speed = speed;
        torque
    }

    fn fail(&mut self, code: u16) {
        od::OBJECT603F.set_value(code);
        self.state = State::Fault;
        self.show();
    }

    fn show(&self) {
        od::OBJECT6041.set_value(match self.state {
            State::Disabled => 0x0240,
            State::Ready => 0x0221,
            State::SwitchedOn => 0x0223,
            State::Enabled => 0x1227,
            State::Fault => 0x0208,
        });
        od::OBJECT6061.set_value(od::OBJECT6060.get_value());
    }

    /// A heartbeat of the node that 1016 names begins the time in which the next one has to come.
    fn hear(&mut self, node: u32) {
        let word = od::OBJECT1016.get(0).unwrap_or(0);
        let time = u64::from(word & 0xFFFF);
        if word >> 16 & 0x7F == node && time > 0 {
            self.watch = Some(Instant::now() + Duration::from_millis(time));
        }
    }

    /// Where the other drives were at the SYNC before.
    fn hear_others(&mut self, socket: &CanSocket) {
        while let Ok(frame) = socket.read_frame() {
            if let (Some(plant), Some((cob_id, data))) = (&mut self.plant, opened(&frame)) {
                plant.hear((cob_id - TPDO_1) as usize, data);
            }
        }
    }

    fn misses_its_master(&mut self) -> bool {
        if od::OBJECT1016.get(0).unwrap_or(0) & 0xFFFF == 0 {
            self.watch = None;
        }
        let late = self.watch.is_some_and(|due| Instant::now() > due);
        if late {
            self.watch = None;
        }
        late
    }
}

/// s between two SYNCs, as 60C2 has it.
fn period() -> f64 {
    f64::from(od::OBJECT60C2.get_value()) * 10f64.powi(i32::from(od::OBJECT60C2.get_exponent()))
}

/// A socket of the interface that is woken by frames whose id is one of these under its mask, as a controller's
/// acceptance filters are.
fn accepting(interface: &str, ids: &[(u32, u32)]) -> CanSocket {
    let socket = CanSocket::open(interface).expect("the interface opens");
    let filters: Vec<CanFilter> = ids.iter().map(|&(id, mask)| CanFilter::new(id, mask)).collect();
    socket.set_filters(&filters).expect("the filters");
    socket
}

/// Number and data of a frame with an 11-bit id.
fn opened(frame: &CanFrame) -> Option<(u32, &[u8])> {
    match (frame, frame.id()) {
        (CanFrame::Data(data), Id::Standard(id)) => Some((u32::from(id.as_raw()), data.data())),
        _ => None,
    }
}

fn send(socket: &CanSocket, cob_id: u32, data: &[u8]) {
    let id = StandardId::new(cob_id as u16).expect("an 11-bit id");
    if let Some(frame) = CanFrame::new(id, data) {
        let _ = socket.write_frame(&frame);
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let interface = arguments.next().expect("an interface");
    let number: u8 = arguments.next().and_then(|text| text.parse().ok()).expect("a node id");
    let plant = arguments.next().map(|path| Plant::read(&path, number));
    if let Some(plant) = &plant {
        od::OBJECT6092.set(0, plant.units_per_turn()).expect("the feed constant");
    }
    let to_all = [(0, NODE | FUNCTION), (SYNC, NODE | FUNCTION), (HEARTBEAT, FUNCTION)];
    let socket = accepting(&interface, &[&to_all[..], &[(u32::from(number), NODE)]].concat());
    socket.set_read_timeout(Duration::from_millis(5)).expect("a timeout");
    // Where the other drives are is read with the SYNC: their frames need not wake this one.
    let others = accepting(&interface, &[(TPDO_1, FUNCTION)]);
    others.set_nonblocking(true).expect("a socket that does not wait");
    od::OBJECT1000.set_value(0x0002_0192);
    od::OBJECT1018.set_serial(1000 + u32::from(number));
    let start = Instant::now();
    let id = NodeId::new(number).expect("1 to 127");
    let mut node = Node::new(id, Callbacks::new(), &od::NODE_MBOX, &od::NODE_STATE, &od::OD_TABLE);
    let mut axis = Axis {
        state: State::Disabled,
        position: plant.as_ref().map_or(0.0, Plant::position),
        speed: 0.0,
        target: 0.0,
        reset_was: false,
        watch: None,
        plant,
    };
    od::OBJECT6064.set_value(axis.position.round() as i32);
    loop {
        let frame = socket.read_frame().ok();
        let mut error = None;
        if let Some((cob_id, data)) = frame.as_ref().and_then(opened) {
            if cob_id == SYNC {
                axis.hear_others(&others);
                error = axis.sync();
            } else if cob_id > HEARTBEAT && cob_id <= HEARTBEAT + 127 {
                axis.hear(cob_id - HEARTBEAT);
            }
            let message = CanMessage::new(CanId::std(cob_id as u16), data);
            let _ = od::NODE_MBOX.store_message(message);
        }
        if axis.misses_its_master() {
            error = Some(HEARTBEAT_LOST);
        }
        let now = start.elapsed().as_micros() as u64;
        if node.process(now) && axis.state != State::Enabled {
            axis.obey();
            axis.show();
        }
        if let Some(code) = error {
            let was = axis.state;
            if code != HEARTBEAT_LOST || was == State::Enabled {
                axis.fail(code);
            }
            let [low, high] = code.to_le_bytes();
            send(&socket, 0x080 + u32::from(number), &[low, high, 0x11, 0, 0, 0, 0, 0]);
        }
        while let Some(message) = od::NODE_MBOX.next_transmit_message() {
            send(&socket, message.id().raw(), message.data());
        }
    }
}
