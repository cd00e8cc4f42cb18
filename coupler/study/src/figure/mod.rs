//! Figures: axes with units, a legend in words, colours that the colour-blind tell apart. Words are measured before they are
//! laid out, so that none overlap.
//!
//! | what | where |
//! | --- | --- |
//! | figures | [`curves`], [`precision`], [`sweep`], [`map`], [`panels`] |
//! | their parts | `area` (axes around what is drawn), [`axis`], `legend`, `style`, `text` (widths) |
//! | what they are put on | `canvas`; [`mod@file`] writes it as SVG, PNG or GIF |

mod area;
pub mod axis;
mod canvas;
pub mod curves;
pub mod file;
mod legend;
pub mod map;
pub mod panels;
pub mod precision;
mod style;
pub mod sweep;
mod text;
