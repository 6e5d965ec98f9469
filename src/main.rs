//! Command line of railsqueal.
fn main() {
    println!("{}", serde_json::to_string_pretty(&railsqueal::job::schema()).unwrap_or_default());
}
