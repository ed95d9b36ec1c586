//! Measures publishing and reading at the size of a scene, against copying the same bytes.

use crate::{error::SimulatorError, ledger::Ledger, records, simulation::Simulation};
use photonstream_protocol::{
    AccessMode, ChannelName, FrameSource, NOTICE_CAPACITY, ProtocolError, Publisher, Reading, SegmentSpec,
    StatisticsRecord, Subscriber, clean_one,
};
use serde::Serialize;
use std::{hint::black_box, time::Instant};

/// Times of one frame in µs, the best of many.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Exchange {
    /// Turning sums into records.
    pub records_us: f64,
    /// Publishing a frame in which every record has changed.
    pub publish_us: f64,
    /// Reading it, whole.
    pub read_us: f64,
    /// Copying its records from memory to memory.
    pub memcpy_us: f64,
}

const ROUNDS: u32 = 60;

impl Exchange {
    pub(super) fn measure(simulation: &Simulation, ledger: &Ledger) -> Result<Self, SimulatorError> {
        let scene = &simulation.scene;
        let mut vsls = records::vsl_records(scene, &simulation.placement);
        let (objects, lights) = (records::object_records(scene), records::light_records(scene));
        let channel = channel("exchange")?;
        let mut publisher = Publisher::create(
            &channel,
            &SegmentSpec {
                vsl_capacity: vsls.len().max(1) as u32,
                distance_capacity: 0,
                object_capacity: objects.len().max(1) as u32,
                light_capacity: lights.len().max(1) as u32,
                scene_text_capacity: scene.resolved_text.len() as u32,
                notice_capacity: NOTICE_CAPACITY,
                scene_hash: scene.hash,
                slots: 3,
            },
        )?;
        let mut copy = vsls.clone();
        let mut best =
            Self { records_us: f64::MAX, publish_us: f64::MAX, read_us: f64::MAX, memcpy_us: f64::MAX };
        let mut subscriber = None;
        for round in 0..ROUNDS {
            let micros = |begun: Instant| begun.elapsed().as_secs_f64() * 1e6;
            let begun = Instant::now();
            records::write_flux(&mut vsls, ledger.readings(scene), 1);
            best.records_us = best.records_us.min(micros(begun));
            vsls.iter_mut().for_each(|v| v.mean_age_s = round as f32);
            let begun = Instant::now();
            publisher.publish(&FrameSource {
                vsls: &vsls,
                changed: None,
                patches: &[],
                patches_changed: None,
                distances: &[],
                distances_changed: None,
                objects: &objects,
                lights: &lights,
                statistics: &StatisticsRecord::default(),
                scene_text: &scene.resolved_text,
                notice: "",
                config_generation: 1,
                simulation_time_s: 0.0,
            })?;
            best.publish_us = best.publish_us.min(micros(begun));
            let subscriber: &mut Subscriber = match &mut subscriber {
                Some(subscriber) => subscriber,
                none => none.insert(Subscriber::attach(&channel, AccessMode::Mapped)?),
            };
            let begun = Instant::now();
            let reading = subscriber.read()?;
            if round > 2 && matches!(reading, Reading::New) {
                best.read_us = best.read_us.min(micros(begun));
            }
            let begun = Instant::now();
            copy.copy_from_slice(&vsls);
            black_box(&copy);
            best.memcpy_us = best.memcpy_us.min(micros(begun));
        }
        publisher.close();
        clean_one(&channel)?;
        Ok(best)
    }
}

/// A channel of this process alone.
pub(super) fn channel(purpose: &str) -> Result<ChannelName, ProtocolError> {
    format!("bench-{purpose}-{}", std::process::id()).parse()
}
