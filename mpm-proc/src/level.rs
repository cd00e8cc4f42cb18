//! The instruction level that Tandem's solvers are built for (`docs/decisions/0009-target-cpu.md`). rustdoc does not get it.

#[cfg(all(
    target_arch = "x86_64",
    not(all(
        target_feature = "avx2",
        target_feature = "bmi1",
        target_feature = "bmi2",
        target_feature = "f16c",
        target_feature = "fma",
        target_feature = "lzcnt",
        target_feature = "movbe"
    )),
    not(any(doc, doctest))
))]
compile_error!(
    "Tandem is built for x86-64-v3, without which it is slow and gives other bits: build it in its checkout, where .cargo/config.toml says so, or with RUSTFLAGS=\"-C target-cpu=x86-64-v3\""
);
