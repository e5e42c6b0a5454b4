fn main() {
    println!("cargo:rerun-if-changed=drive.toml");
    zencan_build::build_node_from_device_config("DRIVE", "drive.toml").expect("drive.toml");
}
