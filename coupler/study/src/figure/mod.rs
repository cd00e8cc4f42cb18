//! Figures: axes with units, a legend in words, colours that the colour-blind tell apart. Words are measured before they are
//! laid out, so that none overlap.
//!
//! | what | where |
//! | --- | --- |
//! | figures | [`chart`] (series of numbers), [`panels`] (particles) |
//! | their parts | `sheet` (areas in rows), `area` (axes around what is drawn), [`axis`], `legend`, `style`, `text` (widths) |
//! | what they are put on | `canvas`; [`mod@file`] writes it as SVG, PNG or GIF |

mod area;
pub mod axis;
mod canvas;
pub mod chart;
pub mod file;
mod legend;
pub mod panels;
mod sheet;
mod style;
mod text;
