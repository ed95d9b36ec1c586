//! Gathers the tables of a config from which a set of VPLs is read, to be edited and read again.

use crate::{
    SceneConfig,
    config::{BlockerConfig, ProxyConfig, VplConfig, VplsConfig},
};
use serde::Serialize;

/// The tables of a config that concern methods of few lights.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VplTables {
    /// `[vpls]`.
    pub vpls: Option<VplsConfig>,
    /// `[[vpl]]`.
    pub vpl: Vec<VplConfig>,
    /// `[[blocker]]`.
    pub blocker: Vec<BlockerConfig>,
    /// `[[proxy]]`.
    pub proxy: Vec<ProxyConfig>,
}

impl VplTables {
    /// Those of a config.
    pub fn of(config: &SceneConfig) -> Self {
        Self {
            vpls: config.vpls.clone(),
            vpl: config.vpl.clone(),
            blocker: config.blocker.clone(),
            proxy: config.proxy.clone(),
        }
    }

    /// Puts them in the place of those of a config.
    pub fn write(self, config: &mut SceneConfig) {
        let Self { vpls, vpl, blocker, proxy } = self;
        (config.vpls, config.vpl, config.blocker, config.proxy) = (vpls, vpl, blocker, proxy);
    }
}
