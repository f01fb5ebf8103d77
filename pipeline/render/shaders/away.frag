#version 330
// How far ahead of the eye a surface is, m.
in vec3 at;
out float away;
void main() { away = -at.z; }
