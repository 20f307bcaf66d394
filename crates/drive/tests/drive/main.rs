mod files;
mod measured;
mod simulated;
