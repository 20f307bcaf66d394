//! Watching allocates nothing from row to row.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use cft_ident::config::held_out::HeldOut;
use cft_ident::effect::{self, AugmentedModel};
use cft_ident::log::Block;
use cft_ident::motion::FilterSettings;
use cft_ident::observe::{AlarmDetector, Observer};
use cft_ident::robot::friction::ViscousCoulomb;
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::{JointKind, Robot};

struct Counting;

static CALLS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, memory: Layout) -> *mut u8 {
        CALLS.fetch_add(1, Relaxed);
        unsafe { System.alloc(memory) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, memory: Layout) {
        unsafe { System.dealloc(pointer, memory) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn nothing_is_allocated_from_row_to_row() {
    let robot = Robot::single_joint("q1", JointKind::Revolute);
    let values = [("gap", 0.01), ("c", 0.3)].map(|(k, x)| (k.to_owned(), x));
    let backlash = effect::read(
        &robot,
        "backlash",
        Some("q1"),
        &values.into_iter().collect(),
    );
    let model = AugmentedModel {
        model: Model {
            robot,
            theta: vec![0.8],
            friction: vec![JointFriction::ViscousCoulomb(ViscousCoulomb {
                viscous: 0.4,
                coulomb: 1.0,
            })],
            offset: vec![0.0],
        },
        effects: vec![backlash.unwrap()],
    };
    let held = [HeldOut {
        joint: "q1".to_owned(),
        external_std: vec![10.0],
        external_99: 2.6,
        ..HeldOut::default()
    }];
    let mut observer = Observer::new(model, &FilterSettings::default()).unwrap();
    let mut alarms = AlarmDetector::new(&held, 1.0, 10.0);
    let mut block = Block::default();
    let mut seen = 0;
    let mut feed = |k: u32| {
        let t = f64::from(k) * 1e-4;
        block.clear();
        block.t.push(t);
        block.q.push((3.0 * t).sin());
        block.tau.push(-7.2 * (3.0 * t).sin());
        observer
            .push(&block, false, &mut |o| {
                assert!(alarms.take(o).is_none());
                seen += 1;
            })
            .unwrap();
    };
    (0..20_000).for_each(&mut feed);
    let before = CALLS.load(Relaxed);
    (20_000..60_000).for_each(&mut feed);
    assert_eq!(CALLS.load(Relaxed) - before, 0);
    assert!(seen > 59_000 - 3_000, "{seen}");
}
