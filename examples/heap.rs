//! Draws the bodies as a run has left them, as SVG: `cargo run --release --example heap -- RUN_DIRECTORY PICTURE.svg`.
//!
//! A spheropolygon is its polygon with a line of twice the sphero-radius around it, round at the corners, which is what
//! SVG draws by itself; so the picture is the geometry of the run, and needs no library. Bodies of a set are coloured by
//! their number, that is, by the layer that they came from.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use coupler::scene::Scene;
use dem_proc::body::shape::Shape;
use interface::Vec2;
use interface::config::{BodyConfig, Motion};

/// Width of the picture in px.
const WIDTH: f64 = 900.0;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(run), Some(picture)) = (args.next(), args.next()) else {
        return Err("usage: heap RUN_DIRECTORY PICTURE.svg".into());
    };
    let run = Path::new(&run);
    let scene = Scene::load(&run.join("scene.toml"), None, &[])?;
    let dem = scene.dem.ok_or("the scene has no bodies")?;
    let places = places(&run.join("bodies.csv"))?;
    if places.len() != dem.bodies.len() {
        return Err(format!("{} rows for {} bodies", places.len(), dem.bodies.len()).into());
    }
    let bodies = || dem.bodies.iter().zip(&places);
    let free = || bodies().filter(|(body, _)| body.motion != Motion::Fixed);
    // What is shown: all that moves, and as much around it.
    let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    for (_, (center, _)) in free() {
        low = low.inf(center);
        high = high.sup(center);
    }
    let margin = 0.05 * (high - low).norm();
    let (low, high) = (low - Vec2::repeat(margin), high + Vec2::repeat(margin));
    let scale = WIDTH / (high.x - low.x);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{:.0}\" stroke-linejoin=\"round\" \
         stroke-linecap=\"round\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        (high.y - low.y) * scale
    );
    let count = free().count().max(1);
    let mut number = 0;
    for (body, (center, angle)) in bodies() {
        let color = if body.motion == Motion::Fixed {
            "#444".to_owned()
        } else {
            number += 1;
            format!("hsl({},60%,50%)", 240 * (number - 1) / count)
        };
        let path = path(body, *center, *angle, low, high, scale)?;
        let width = 2.0 * body.sphero_radius * scale;
        writeln!(
            svg,
            "<path d=\"{path}\" fill=\"{color}\" stroke=\"{color}\" stroke-width=\"{width:.2}\"/>"
        )?;
    }
    svg.push_str("</svg>\n");
    std::fs::write(picture, svg)?;
    Ok(())
}

/// Centre of mass in m and angle in rad of every body.
fn places(file: &Path) -> Result<Vec<(Vec2, f64)>, Box<dyn Error>> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let row = |line: &str| {
        let numbers: Result<Vec<f64>, _> = line.split(',').skip(1).map(str::parse).collect();
        let numbers = numbers?;
        match numbers[..] {
            [x, y, angle, ..] => Ok((Vec2::new(x, y), angle)),
            _ => Err(format!("{line}: expected x, y, angle").into()),
        }
    };
    text.lines().skip(1).map(row).collect()
}

/// The outline of a body in px, y downwards.
fn path(
    body: &BodyConfig,
    center: Vec2,
    angle: f64,
    low: Vec2,
    high: Vec2,
    scale: f64,
) -> Result<String, Box<dyn Error>> {
    let shape = Shape::new(&body.shape, body.sphero_radius, false)
        .map_err(|(key, text)| format!("{}: {key}: {text}", body.name))?;
    let (sin, cos) = angle.sin_cos();
    let mut path = String::new();
    for (k, v) in shape.vertices.iter().enumerate() {
        let p = center + Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
        let (x, y) = ((p.x - low.x) * scale, (high.y - p.y) * scale);
        write!(path, "{}{x:.2} {y:.2}", if k == 0 { 'M' } else { 'L' })?;
    }
    path.push('Z');
    Ok(path)
}
