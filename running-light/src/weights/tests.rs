//! Areas by hand, and that a little at a time ends where all at once does.

use super::*;
use glam::Vec3;

fn at(position: Vec3) -> Vpl {
    Vpl { position, normal: Vec3::Y, albedo: Vec3::ONE, weight: -1.0 }
}

/// 11 VPLs at places without order, by the golden ratio.
fn scattered() -> [Vpl; 11] {
    core::array::from_fn(|i| {
        let place = |step: f32| (i as f32 * step).fract() * 5.0;
        at(Vec3::new(place(0.618), place(0.755), place(0.57)))
    })
}

fn weights(vpls: &[Vpl]) -> impl Iterator<Item = f32> {
    vpls.iter().map(|vpl| vpl.weight)
}

/// At 0, 1 and 3 m the closest others are at 1, 1 and 2 m: discs of π/4, π/4 and π m². With a = 0.5 m² weights are twice
/// that.
#[test]
fn area_is_a_disc_half_way_to_the_closest() {
    let mut vpls = [0.0, 1.0, 3.0].map(|x| at(Vec3::X * x));
    automatic_weights(&mut vpls, 1.0);
    assert!(weights(&vpls).eq([PI / 4.0, PI / 4.0, PI]));
    automatic_weights(&mut vpls, 0.5);
    assert!(weights(&vpls).eq([PI / 2.0, PI / 2.0, 2.0 * PI]));
}

#[test]
fn one_alone_keeps_its_weight_and_two_in_one_place_have_none() {
    let mut alone = [at(Vec3::ZERO)];
    let mut amortised = AmortisedWeights::new();
    automatic_weights(&mut alone, 1.0);
    (0..5).for_each(|_| amortised.step(&mut alone, 1.0));
    assert_eq!(alone[0].weight, -1.0);
    let mut both = [at(Vec3::ONE); 2];
    automatic_weights(&mut both, 1.0);
    assert!(weights(&both).eq([0.0; 2]));
    automatic_weights(&mut [], 1.0);
    AmortisedWeights::new().step(&mut [], 1.0);
}

/// N = 11: all weights after exactly 121 steps, bit for bit; one step earlier the last one is missing.
#[test]
fn amortised_weights_are_whole_after_n_squared_steps() {
    let (mut whole, mut vpls) = (scattered(), scattered());
    automatic_weights(&mut whole, 1.0);
    let mut amortised = AmortisedWeights::new();
    (0..120).for_each(|_| amortised.step(&mut vpls, 1.0));
    assert_eq!(vpls[..10], whole[..10]);
    assert_eq!(vpls[10].weight, -1.0);
    amortised.step(&mut vpls, 1.0);
    assert_eq!(vpls, whole);
}

/// After a move at any moment of a pass (121 steps), the steps that it names hold whole weights again: N² from the beginning
/// of a comparison, at most N − 1 more in the middle of one.
#[test]
fn amortised_weights_follow_moves() {
    for before in 0..=121 {
        let mut vpls = scattered();
        let mut amortised = AmortisedWeights::new();
        (0..before).for_each(|_| amortised.step(&mut vpls, 1.0));
        vpls[3].position = vpls[7].position + Vec3::X * 0.01;
        let steps = amortised.steps_until_whole(11);
        assert_eq!(steps, 121 + (11 - before % 11) % 11, "{before}");
        (0..steps).for_each(|_| amortised.step(&mut vpls, 1.0));
        let mut whole = vpls;
        automatic_weights(&mut whole, 1.0);
        assert_eq!(vpls, whole, "{before}");
    }
}

/// Two sets, one step each in turn, end as if each were alone.
#[test]
fn sets_do_not_disturb_each_other() {
    let (mut a, mut b) = (scattered(), [0.0, 1.0, 3.0].map(|x| at(Vec3::X * x)));
    let mut states = [AmortisedWeights::new(), AmortisedWeights::new()];
    for _ in 0..121 {
        states[0].step(&mut a, 1.0);
        states[1].step(&mut b, 1.0);
    }
    let (mut whole_a, mut whole_b) = (a, b);
    automatic_weights(&mut whole_a, 1.0);
    automatic_weights(&mut whole_b, 1.0);
    assert_eq!((a, b), (whole_a, whole_b));
}

#[test]
fn shorter_sets_start_anew() {
    let mut vpls = scattered();
    let mut amortised = AmortisedWeights::new();
    (0..90).for_each(|_| amortised.step(&mut vpls, 1.0));
    let short = &mut vpls[..4];
    (0..16).for_each(|_| amortised.step(short, 1.0));
    let mut whole = scattered();
    automatic_weights(&mut whole[..4], 1.0);
    assert_eq!(*short, whole[..4]);
}
