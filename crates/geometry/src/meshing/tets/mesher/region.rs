//! The background, dielectric or conductor that may fill a part of space.

/// The background, dielectric or conductor that fills a part of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Region {
    /// No body.
    #[default]
    Background,
    /// The dielectric with this index.
    Dielectric(u32),
    /// The conductor with this index.
    Conductor(u32),
}

impl Region {
    /// The conductor that fills the region, if one does.
    pub(super) fn conductor(self) -> Option<u32> {
        match self {
            Self::Conductor(c) => Some(c),
            Self::Background | Self::Dielectric(_) => None,
        }
    }

    /// Whether a conductor fills the region: it is then not part of the final mesh.
    pub(super) fn is_conductor(self) -> bool {
        self.conductor().is_some()
    }
}
