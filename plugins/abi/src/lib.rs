//! rumple-plugin-abi
