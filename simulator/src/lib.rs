//! A scene into the flux of its virtual surface lights: placement, photon streaming, publishing.
