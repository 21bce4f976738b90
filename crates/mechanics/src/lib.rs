//! Part of elastocap.
