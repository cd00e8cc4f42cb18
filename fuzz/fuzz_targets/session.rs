#![no_main]

tandem_fuzz::fuzz!();
