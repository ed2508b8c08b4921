//! rumple-plugin-sdk
