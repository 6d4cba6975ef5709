mod indirect;
mod own_structure;
mod shadows;
