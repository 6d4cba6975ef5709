mod candidates;
mod range;
mod selection;
