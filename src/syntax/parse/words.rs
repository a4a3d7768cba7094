//! What the rules of the grammar are called in messages.

use super::Rule;

/// What a rule is called in a message; nothing for what goes without saying.
pub fn words(rule: Rule) -> &'static [&'static str] {
    match rule {
        Rule::version => &["`gonogo 1`"],
        Rule::units => &["`units`"],
        Rule::general => &["`tolerances`"],
        Rule::use_file => &["`use`"],
        Rule::let_dim => &["`let`"],
        Rule::material => &["`material`"],
        Rule::part | Rule::family | Rule::member => &["`part`"],
        Rule::table => &["`table`"],
        Rule::row => &["`row`"],
        Rule::row_key => &["a size such as `6` or `M6`"],
        Rule::assembly => &["`assembly`"],
        Rule::station => &["`station`"],
        Rule::inspect => &["`inspect`"],
        Rule::train => &["`train`"],
        Rule::feature | Rule::op => &["`add`", "`cut`", "`keep`"],
        Rule::outline | Rule::kw_outline => &["`outline`"],
        Rule::kw_group => &["`group`"],
        Rule::start => &["`from`"],
        Rule::line | Rule::kw_line => &["`line`"],
        Rule::arc | Rule::kw_arc => &["`arc`"],
        Rule::kw_radius => &["`radius`"],
        Rule::hand => &["`left`", "`right`"],
        Rule::long => &["`long`"],
        Rule::corner => &["`round`", "`chamfer`"],
        Rule::side_name => &["a name"],
        Rule::root => &["`root`"],
        Rule::place => &["`place`"],
        Rule::measure => &["`measure`"],
        Rule::kw_from => &["`from`"],
        Rule::kw_to => &["`to`"],
        Rule::within | Rule::kw_within => &["`within`"],
        Rule::face | Rule::face_dot | Rule::face_name => &["a face such as `plate.slab.top`"],
        Rule::camera => &["`camera`"],
        Rule::light => &["`light`"],
        Rule::floor => &["`floor`"],
        Rule::vary => &["`vary`"],
        Rule::watch => &["`watch`"],
        Rule::ignore => &["`ignore`"],
        Rule::on | Rule::kw_on => &["`on`"],
        Rule::at | Rule::kw_at => &["`at`"],
        Rule::turn | Rule::kw_turn => &["`turn`"],
        Rule::mode => &["`fixed`", "`auto`"],
        Rule::each => &["`each`"],
        Rule::field | Rule::arg => &["`name = value`"],
        Rule::key | Rule::name | Rule::path | Rule::segment => &["a name"],
        Rule::word | Rule::call => &["a word"],
        Rule::class => &["`ISO2768-m`", "`exact`"],
        Rule::value | Rule::dim => &["a value"],
        Rule::number | Rule::quantity | Rule::integer => &["a number"],
        Rule::string => &["a file name in quotes"],
        Rule::point => &["a point `(x, y, z)`"],
        Rule::args => &["arguments in parentheses"],
        Rule::count => &["a count such as `3x`"],
        Rule::unit => &["a unit"],
        Rule::plus_minus | Rule::deviations | Rule::limits | Rule::fit | Rule::basic => &["a tolerance"],
        Rule::plus | Rule::times => &["an operator"],
        Rule::state_name | Rule::state => &["`mmc`", "`nominal`", "`lmc`"],
        Rule::index => &["`[`"],
        Rule::field_body
        | Rule::part_body
        | Rule::table_body
        | Rule::outline_body
        | Rule::assembly_body
        | Rule::station_body
        | Rule::inspect_body => &["`{`"],
        _ => &[],
    }
}
