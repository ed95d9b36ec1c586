//! Turns published frames back into records in another map of the same memory, through every access mode.

use photonstream_protocol::*;

#[test]
fn first() {
    let root = tempfile::tempdir().unwrap();
    let rt = Runtime::at(root.path());
    let ch = ChannelName::default();
    let spec = SegmentSpec {
        vsl_capacity: 1000,
        object_capacity: 10,
        light_capacity: 4,
        scene_text_capacity: 1000,
        scene_hash: 7,
        slots: 3,
    };
    let mut p = Publisher::create_in(&rt, &ch, &spec).unwrap();
    let mut s = Subscriber::attach_in(&rt, &ch, AccessMode::Mapped).unwrap();
    assert_eq!(s.read().unwrap(), Reading::Empty);
    let vsls = vec![VslRecord { area: 2.0, ..Default::default() }; 500];
    let st = StatisticsRecord::default();
    let f = FrameSource {
        vsls: &vsls,
        changed: None,
        objects: &[],
        lights: &[],
        statistics: &st,
        scene_text: "hi",
        config_generation: 1,
        simulation_time_s: 0.5,
    };
    assert_eq!(p.publish(&f).unwrap(), 1);
    assert_eq!(s.read().unwrap(), Reading::New);
    assert_eq!(s.frame().unwrap().vsls.len(), 500);
    assert_eq!(&*s.frame().unwrap().scene_text, "hi");
    assert_eq!(s.liveness(), Liveness::Live);
    drop(p);
    assert_eq!(s.liveness(), Liveness::Retired);
}
