// The picture's own element.

export const canvas = document.getElementById("canvas");
