//! A plain disc code on the same settled box, so that figures taken on a busy machine have something to be compared
//! with: pair list, linear spring, dashpot, friction history, leapfrog; no energies, no step limit, no polygons.
//!
//! `cargo run --release -p dem-proc --example yardstick -- 1000`

use interface::session::cpu_time;
use mechanics::generate::Grain;

use grain_box::{DT, STIFFNESS as K, grain_box, run};

#[path = "../benches/grain_box.rs"]
mod grain_box;

#[derive(Clone, Copy, Default)]
struct Disc {
    x: [f64; 2],
    v: [f64; 2],
    w: f64,
    r: f64,
    m: f64,
    f: [f64; 2],
    t: f64,
}

fn main() {
    let count: usize = std::env::args()
        .nth(1)
        .map_or(1000, |a| a.parse().expect("a number"));
    let dem = run(&grain_box(Grain::Disc, count, 1), 60_000);
    let system = dem.bodies();
    let mut discs: Vec<Disc> = (3..system.len())
        .map(|b| Disc {
            x: system.state[b].center.into(),
            r: system.state[b].radius,
            m: system.properties[b].mass,
            ..Disc::default()
        })
        .collect();
    let mut pairs: Vec<(u32, u32, f64)> = Vec::new();
    for i in 0..discs.len() {
        for j in i + 1..discs.len() {
            let (a, b) = (&discs[i], &discs[j]);
            let d = (a.x[0] - b.x[0]).hypot(a.x[1] - b.x[1]);
            if d < a.r + b.r + 0.001 {
                pairs.push((i as u32, j as u32, 0.0));
            }
        }
    }
    let mut best = f64::INFINITY;
    let mut contacts = 0;
    for _ in 0..10 {
        let start = cpu_time();
        for _ in 0..400 {
            contacts = force(&mut discs, &mut pairs);
            for d in &mut discs {
                // Walls and the ledger left out; a tiny drag keeps the pile where it is.
                for k in 0..2 {
                    d.v[k] = 0.9 * (d.v[k] + 1e-9 * d.f[k] / d.m * DT);
                    d.x[k] += d.v[k] * DT;
                }
                d.w = 0.9 * (d.w + 1e-9 * d.t / (0.5 * d.m * d.r * d.r) * DT);
                d.f = [0.0; 2];
                d.t = 0.0;
            }
        }
        best = best.min(cpu_time().saturating_sub(start).as_secs_f64() / 400.0);
    }
    println!(
        "plain discs x {count}: {} pairs, {contacts} contacts, {:.1} us of CPU a step, {:.1} ns a contact",
        pairs.len(),
        best * 1e6,
        best * 1e9 / contacts as f64
    );
}

fn force(discs: &mut [Disc], pairs: &mut [(u32, u32, f64)]) -> usize {
    let mut contacts = 0;
    for (i, j, spring) in pairs {
        let (a, b) = (discs[*i as usize], discs[*j as usize]);
        let d = [a.x[0] - b.x[0], a.x[1] - b.x[1]];
        let reach = a.r + b.r;
        let sq = d[0] * d[0] + d[1] * d[1];
        if sq >= reach * reach {
            *spring = 0.0;
            continue;
        }
        contacts += 1;
        let l = sq.sqrt();
        let n = [d[0] / l, d[1] / l];
        let v = [a.v[0] - b.v[0], a.v[1] - b.v[1]];
        let v_n = v[0] * n[0] + v[1] * n[1];
        let v_t = v[1] * n[0] - v[0] * n[1] + a.r * a.w + b.r * b.w;
        let m = a.m * b.m / (a.m + b.m);
        let c = 0.6 * (K * m).sqrt();
        let f_n = (K * (reach - l) - c * v_n).max(0.0);
        *spring += v_t * DT;
        let f_t = (-0.5 * K * *spring - 0.7 * c * v_t).clamp(-0.5 * f_n, 0.5 * f_n);
        *spring = spring.clamp(-f_n / K, f_n / K);
        let f = [f_n * n[0] - f_t * n[1], f_n * n[1] + f_t * n[0]];
        let p = &mut discs[*i as usize];
        p.f[0] += f[0];
        p.f[1] += f[1];
        p.t += f_t * a.r;
        let q = &mut discs[*j as usize];
        q.f[0] -= f[0];
        q.f[1] -= f[1];
        q.t += f_t * b.r;
    }
    contacts
}
